"""Which speeds to avoid and which to use: the search, its ranges, the decision over speed and torque."""
