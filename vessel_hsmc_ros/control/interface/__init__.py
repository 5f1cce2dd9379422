"""What every control law is made of: base classes, the known ship, networks, checks, and the registry."""
