//! What is told where something stands in the way, and what is not taken up.
