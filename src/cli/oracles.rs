//! The oracles that flags name: the device is opened once, and each lane gets an oracle of its own.

use std::sync::Arc;

use super::args::SceneArgs;
use super::quiet::quietly;
use super::{CliError, Streams};
use crate::oracle::wgpu::{Gpu, GpuStage, Hardware};
use crate::oracle::{
    Always, Approximate, CostModel, HierarchicalZ, Oracle, OracleError, Questions, Schedule, Sim,
    Simulated, Stage, Tables,
};

/// The oracles of one invocation; the device is opened once.
pub(super) struct Oracles {
    pub(super) names: Vec<String>,
    gpu: Option<Arc<Gpu>>,
    /// What the simulated device costs and does.
    simulated: (CostModel, Schedule),
}

impl Oracles {
    /// Whether every name is one of an oracle.
    pub(super) fn known(names: &[String]) -> Result<(), CliError> {
        let known: Vec<&str> =
            ["sim", "hierarchical-z", "tables", "simulated", "last-frame", "always"]
                .into_iter()
                .chain(Questions::ALL.map(Questions::name))
                .collect();
        names.iter().find(|name| !known.contains(&name.as_str())).map_or(Ok(()), |name| {
            let what = format!("no oracle is called '{name}'; there are {}", known.join(", "));
            Err(CliError::Usage(what))
        })
    }

    /// Opens what the names need. Without names: `sim`, and `hardware` where there is a device.
    pub(super) fn open(
        names: &[String],
        adapter: Option<&str>,
        streams: &mut Streams<'_>,
    ) -> Result<Self, CliError> {
        let wanted = names.is_empty() || names.iter().any(|name| on_device(name));
        let found = if wanted {
            quietly(|| Gpu::open(adapter))
        } else {
            Err(OracleError::NoDevice(String::new()))
        };
        let asked_for = !names.is_empty() || adapter.is_some();
        let mut names = if names.is_empty() {
            vec!["sim".to_owned(), "hardware".to_owned()]
        } else {
            names.to_vec()
        };
        let simulated = (CostModel::lavapipe(), Schedule::default());
        match found {
            Ok(gpu) => Ok(Self { names, gpu: Some(gpu), simulated }),
            Err(error) if wanted && asked_for => Err(error.into()),
            Err(error) => {
                if wanted {
                    writeln!(streams.talk, "WARNING: {error}")?;
                    writeln!(
                        streams.talk,
                        "WARNING: no hardware queries are judged; the simulated device runs alone"
                    )?;
                }
                names.retain(|name| !on_device(name));
                Ok(Self { names, gpu: None, simulated })
            }
        }
    }

    /// The same with a simulated device of that cost, which does what the flags say.
    pub(super) fn simulating(self, cost: &CostModel, args: &SceneArgs) -> Self {
        Self { simulated: (cost.clone(), args.schedule()), ..self }
    }

    /// One oracle a name for `stage`, made anew for each lane; the geometry on the device is shared. The
    /// simulated device has its streams from `seed`.
    pub(super) fn stage(&self, stage: &Stage, seed: u64) -> Result<StagedOracles<'_>, OracleError> {
        let (cost, schedule) = self.simulated.clone();
        Ok(StagedOracles {
            names: &self.names,
            simulated: (cost, Schedule { seed, ..schedule }),
            stage: stage.clone(),
            gpu: self.gpu.as_ref().map(|gpu| GpuStage::new(gpu, stage)).transpose()?,
        })
    }
}

/// Whether the oracle of that name asks a real device.
fn on_device(name: &str) -> bool {
    Questions::of(name).is_some()
}

/// The oracles of one invocation over one scene.
pub(super) struct StagedOracles<'a> {
    pub(super) names: &'a [String],
    simulated: (CostModel, Schedule),
    stage: Stage,
    gpu: Option<Arc<GpuStage>>,
}

impl StagedOracles<'_> {
    /// One of that name.
    pub(super) fn make(&self, name: &str) -> Result<Box<dyn Oracle>, OracleError> {
        match name {
            "sim" => Ok(Box::new(Sim::new(self.stage.clone()))),
            "hierarchical-z" => Ok(Box::new(HierarchicalZ::new(self.stage.clone()))),
            "tables" => Ok(Box::new(Tables::new(self.stage.clone()))),
            "simulated" => {
                let (cost, schedule) = self.simulated.clone();
                Ok(Box::new(Simulated::new(self.stage.clone(), cost, schedule)))
            }
            "last-frame" => Ok(Box::new(Approximate::last_frame(self.stage.clone()))),
            "always" => Ok(Box::<Always>::default()),
            _ => {
                let stage = self.gpu.as_ref().expect("hardware is named only where it was opened");
                let questions = Questions::of(name).expect("names are checked before");
                Ok(Box::new(Hardware::new(stage, questions)?))
            }
        }
    }
}
