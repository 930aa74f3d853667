"""This installation: its versions and machine for reports of errors, and checks that it works."""
