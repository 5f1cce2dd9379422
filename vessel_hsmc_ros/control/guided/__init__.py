"""The guided law: one Kalman filter of the ship in the water, and one regulator of its course and distance from the track."""
