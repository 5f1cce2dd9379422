"""Forecasts of missions: whether they can be sailed, their runs in drawn conditions, and the page."""
