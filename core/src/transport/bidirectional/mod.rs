//! Bidirectional methods (Veach 1997, chapter 10; Davidovič et al. 2014): light paths whose vertices are stored and
//! splatted, camera paths whose vertices are connected to stored ones.

pub mod mis;
