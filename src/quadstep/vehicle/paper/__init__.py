"""The quadrotor: state, kinematics, Lagrange dynamics (Eqs 1-10, 66), rotor map (Eq. 5) and disturbance (Eq. 67)."""
