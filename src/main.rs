//! The command line; see [`plainsight::cli`].

use std::process::ExitCode;

fn main() -> ExitCode {
    let terminal = terminal_size::terminal_size_of(std::io::stdout());
    let streams = plainsight::cli::Streams {
        out: &mut std::io::stdout(),
        talk: &mut std::io::stderr(),
        width: terminal.map(|(width, _)| usize::from(width.0)),
    };
    let code = plainsight::cli::main(std::env::args_os(), plainsight::cull::CULLERS, streams);
    ExitCode::from(code)
}
