//! The bus: packets, control table, server, and a client that nobody here wrote.

mod bench;
mod client;
mod indirect;
mod instructions;
mod mirrors;
mod noise;
mod packets;
mod recover;
mod requests;
mod safety;
mod several;
mod table;
mod writes;
