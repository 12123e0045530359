//! The command line; see [`plainsight::cli`].

use std::process::ExitCode;

fn main() -> ExitCode {
    let streams =
        plainsight::cli::Streams { out: &mut std::io::stdout(), talk: &mut std::io::stderr() };
    let code = plainsight::cli::main(std::env::args_os(), plainsight::cull::CULLERS, streams);
    ExitCode::from(code)
}
