"""Missions: files of planners and charts as waypoints that the reference takes."""
