//! All integration tests, one binary. `common` is the shared runner and seed table: every index,
//! culler and oracle that is registered runs through it.

mod accuracy;
mod broken;
mod cache;
mod calibrate;
mod checks;
mod cli;
mod common;
mod compare;
mod determinism;
mod effects;
mod faults;
mod foreign;
mod golden;
mod hard;
mod held;
mod index;
mod lavapipe;
mod limits;
mod margins;
mod memory;
mod oracle;
mod partition;
mod proxies;
mod readers;
mod report;
mod simulated;
mod snapshots;
mod stress;
mod survey;
mod tidy;
mod tolerance;
mod why;
