//! Drivers say things on standard error while a device is opened that no user can use: known lines are left
//! out, everything else is passed on.
//!
//! While the device is opened, standard error goes through `sed`, a process of its own: should the driver end
//! this one, what it said last still comes out. Where there is no `sed`, nothing is left out.

/// Lines that are left out, as basic regular expressions of whole lines:
///
/// - libwayland's, which Mesa's layer that sorts devices calls although nothing is shown, twice where there
///   is no session (containers, CI, `ssh`);
/// - Mesa's about its software and its young drivers, by version;
/// - Mesa's about a home where nothing can be written, as containers have, and about graphics of old processors, of a device that is found and not used.
#[cfg(unix)]
const NOISE: [&str; 5] = [
    r"error: XDG_RUNTIME_DIR is invalid or not set in the environment\.",
    r"WARNING: [a-z0-9_]* is not a conformant [Vv]ulkan implementation, testing use only\.",
    r"MESA-INTEL: warning: [A-Za-z ]* Vulkan support is incomplete",
    r"Failed to create .* for shader cache (.*)---disabling\.",
    r"Cannot use .* for shader cache (not a directory)---disabling\.",
];

/// Lends standard error of the driver's to the filter while `open` works.
#[cfg(unix)]
pub(super) fn quietly<T>(open: impl FnOnce() -> T) -> T {
    let filter = filter::Filter::start(&NOISE);
    let opened = open();
    drop(filter);
    opened
}

#[cfg(not(unix))]
pub(super) fn quietly<T>(open: impl FnOnce() -> T) -> T {
    open()
}

#[cfg(unix)]
mod filter {
    use std::io::stderr;
    use std::os::fd::{AsFd, OwnedFd};
    use std::process::{Child, Command, Stdio};
    use std::time::Duration;

    /// Looks, a millisecond apart, for the end of the filter. It comes at once, unless something else was
    /// started meanwhile that holds standard error.
    const LOOKS: u32 = 1000;

    /// Standard error, led through another process until this is dropped.
    pub(super) struct Filter {
        saved: OwnedFd,
        child: Child,
    }

    impl Filter {
        /// Leaves out whole lines of these forms; `None` where it cannot be done.
        pub(super) fn start(noise: &[&str]) -> Option<Self> {
            let saved = stderr().as_fd().try_clone_to_owned().ok()?;
            let mut command = Command::new("sed");
            for line in noise {
                command.arg("-e").arg(format!("/^{line}$/d"));
            }
            // What drivers write need not be text of the user's language.
            command.env("LC_ALL", "C").stdin(Stdio::piped()).stdout(saved.try_clone().ok()?);
            let mut child = command.spawn().ok()?;
            let pipe = child.stdin.take();
            let led = pipe.is_some_and(|pipe| rustix::stdio::dup2_stderr(pipe).is_ok());
            let filter = Self { saved, child };
            led.then_some(filter)
        }
    }

    impl Drop for Filter {
        fn drop(&mut self) {
            // Closes the last way into the pipe, so that the filter ends.
            if rustix::stdio::dup2_stderr(&self.saved).is_err() {
                return;
            }
            for _ in 0..LOOKS {
                if !matches!(self.child.try_wait(), Ok(None)) {
                    return;
                }
                std::thread::sleep(Duration::from_millis(1));
            }
        }
    }

    #[cfg(test)]
    mod tests {
        use std::io::Write;

        use super::*;

        #[test]
        fn known_lines_are_left_out_and_others_are_not() {
            let mut noise = Command::new("sed");
            for line in super::super::NOISE {
                noise.arg("-e").arg(format!("/^{line}$/d"));
            }
            let mut child = noise.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
            let said = "error: XDG_RUNTIME_DIR is invalid or not set in the environment.\n\
                one\n\
                WARNING: lavapipe is not a conformant vulkan implementation, testing use only.\n\
                WARNING: lavapipe is not what it was.\n\
                MESA-INTEL: warning: Haswell Vulkan support is incomplete\n\
                Failed to create /x for shader cache (Read-only file system)---disabling.\n\
                MESA-INTEL: error: two\n";
            child.stdin.take().unwrap().write_all(said.as_bytes()).unwrap();
            let left = child.wait_with_output().unwrap().stdout;
            let left = String::from_utf8(left).unwrap();
            assert_eq!(
                left,
                "one\nWARNING: lavapipe is not what it was.\nMESA-INTEL: error: two\n"
            );
        }
    }
}
