"""What uncertain inputs do to the motions along the speed, and which of them matter."""
