//! The flash image on an emulated STM32, with the fingertip board around it.
