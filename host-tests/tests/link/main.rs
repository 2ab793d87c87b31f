//! The bus: packets, control table, server, and a client that nobody here wrote.

mod bench;
mod client;
mod document;
mod instructions;
mod noise;
mod packets;
mod requests;
mod safety;
mod several;
mod table;
mod writes;
