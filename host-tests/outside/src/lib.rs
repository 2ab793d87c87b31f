//! A finger of somebody else's.
