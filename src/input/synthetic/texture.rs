//! How surfaces look, as functions of the place on them.

pub mod car;
pub mod front;
pub mod indoor;
pub mod outdoor;
pub mod print;
pub mod road;
