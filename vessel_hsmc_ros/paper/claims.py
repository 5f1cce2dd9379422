"""Every claim of the paper that a run can test, in the paper's order.

Source: Trajectory tracking of underactuated surface vessels based on neural network and hierarchical sliding mode.
"""

from vessel_hsmc_ros.paper.claims_overview import ABSTRACT, INTRODUCTION, PROBLEM
from vessel_hsmc_ros.paper.claims_simulations import SIMULATIONS
from vessel_hsmc_ros.paper.claims_stability import STABILITY

CLAIMS = (*ABSTRACT, *INTRODUCTION, *PROBLEM, *STABILITY, *SIMULATIONS)
