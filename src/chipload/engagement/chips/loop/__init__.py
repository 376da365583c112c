"""The boundary of a covered area as one loop, untangled where the cutter comes back."""
