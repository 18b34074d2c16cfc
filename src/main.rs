//! The binary. In: the arguments of the process. Out: the exit code of [`feedwright::cli::run`].

fn main() -> std::process::ExitCode {
    feedwright::cli::run()
}
