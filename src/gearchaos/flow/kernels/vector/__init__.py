"""What all kernels compute with: vectors of lanes, their arrays, rows of measures, Taylor polynomials."""
