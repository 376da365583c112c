"""The largest cutter at each of given pallet angles."""
