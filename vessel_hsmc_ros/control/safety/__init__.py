"""What stands between a law and a thruster: which inputs count, which commands leave, and what happens when either fails."""
