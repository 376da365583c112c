"""What a person reads: the result folder, its report, its scene. The only room that draws."""
