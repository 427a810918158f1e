"""The machine as numbers: pieces of the brake torque, their flow, and the compiler of kernels."""
