"""Commands tried in a process of their own, which may hang, run out of memory or die without harm to the tests."""
