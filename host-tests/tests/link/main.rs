//! The bus: packets, control table, server, parameter record, and a client that nobody here wrote.

mod bench;
mod client;
mod document;
mod instructions;
mod noise;
mod packets;
mod requests;
mod safety;
mod several;
mod store;
mod table;
mod writes;
