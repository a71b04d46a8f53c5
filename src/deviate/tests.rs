//! The comparison against brute force.
