"""Forecasts: whether a vessel can do a mission in today's wind and current, and what it takes."""
