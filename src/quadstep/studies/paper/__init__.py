"""The paper's simulation study (Section 6) and the stress flights that test what its cases cannot."""
