"""The reproduction of the paper: its cases, measured and drawn, and its claims tested against the results."""
