"""Identification of a ship from its recorded motion: hull data with standard errors, and how well they predict."""
