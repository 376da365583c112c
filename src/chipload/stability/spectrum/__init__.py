"""Greatest eigenvalue of a small Hessenberg matrix."""
