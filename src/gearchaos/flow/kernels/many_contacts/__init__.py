"""The motion of systems with several one-sided contacts: contact sets, switches, measures."""
