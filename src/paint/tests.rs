//! Tests of painting, against sinks of their own.
