"""The guided law: guidance by velocity commands, estimates of current and actuators, station keeping, gains and margins."""
