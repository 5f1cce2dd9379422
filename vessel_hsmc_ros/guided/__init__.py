"""The guided law: guidance by velocity commands, estimates of drift and actuators, station keeping, gains and margins."""
