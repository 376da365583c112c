"""Force coefficients from measured forces."""
