"""The check of a connection with a boat: what is expected, what is there, live or in a bag, and the rules."""
