"""The control of a vessel: interface of laws, laws, loop, safety."""
