//! Instant radiosity (Keller 1997): the vertices of light paths light what the camera sees, as virtual point
//! lights.
//!
//! [`light_pass`] traces the light paths of a set of virtual lights, [`lights`] says what one of them sends
//! to a point. [`lighting`] connects camera paths with a set. The geometry term is bounded, and what the
//! bound cuts is found by the continuation of the path (Kollig and Keller 2004). Light of lights without
//! extent that comes by mirrors and smooth glass is found by virtual lights and splats alone.

pub mod light_pass;
pub mod lighting;
pub mod lights;
