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
mod gate;
mod golden;
mod hard;
mod held;
mod index;
mod lavapipe;
mod margins;
mod memory;
mod oracle;
mod part_boxes;
mod partition;
mod paths;
mod proxies;
mod readers;
mod report;
mod simulated;
mod snapshots;
mod stress;
mod survey;
mod tidy;
mod tolerance;
mod twins;
mod why;
