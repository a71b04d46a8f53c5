//! Each defect on the smallest model that shows it.
