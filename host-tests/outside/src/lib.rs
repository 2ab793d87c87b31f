//! A project of somebody else: the first example of the core's front page, under the core as a package.
#![doc = include_str!("../../../src/README.md")]
