//! Reads volumes and maps, writes pictures.
