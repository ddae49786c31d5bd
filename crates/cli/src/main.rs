//! The command line: parse, one `match`, library calls.

mod commands;

use clap::error::ErrorKind;
use clap::{Parser, Subcommand};
use std::process::ExitCode;

/// Cells, portals and potentially visible sets for buildings and game levels.
#[derive(Parser)]
#[command(name = "enfilade", version, arg_required_else_help = true)]
struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Split a scene into cells, compute what each cell can see, and write a .pvs file.
    #[command(
        after_help = "Examples:\n  enfilade bake data/buildings/office.glb -o office.pvs\n  enfilade bake villa.glb --unseen 0.1% --rows sampled --view-cells auto --json"
    )]
    Bake(commands::bake::Args),
    /// Test a .pvs file against its model, independently of the bake.
    #[command(
        after_help = "Examples:\n  enfilade check office.pvs --model data/buildings/office.glb --rays 10M\n  enfilade check level.bsp --json"
    )]
    Check(commands::check::Args),
    /// Walk a camera through a model and print what each culling mode draws.
    #[command(
        after_help = "Examples:\n  enfilade walk office.pvs --model data/buildings/office.glb --mode all\n  enfilade walk office.pvs --model data/buildings/office.glb --path random:100 --verify-pixels --frames pictures"
    )]
    Walk(commands::walk::Args),
    /// Summarise a .pvs file.
    #[command(after_help = "Examples:\n  enfilade info office.pvs\n  enfilade info office.pvs --json")]
    Info(commands::info::Args),
    /// Explain why a cell sees an object or another cell, or doesn't.
    #[command(
        after_help = "Examples:\n  enfilade why office.pvs cell:3 object:17\n  enfilade why office.pvs 3 cell:4 --model data/buildings/office.glb"
    )]
    Why(commands::why::Args),
    /// Print cells, portals, objects and rows.
    #[command(after_help = "Examples:\n  enfilade dump office.pvs --rows cells\n  enfilade dump office.pvs --json")]
    Dump(commands::dump::Args),
    /// Write the model as .glb with one node per object, for engines.
    #[command(
        after_help = "Examples:\n  enfilade export office.pvs --model data/buildings/office.glb -o objects.glb\n  enfilade export level.pvs --model level.map -o level.glb --json"
    )]
    Export(commands::export::Args),
    /// Write a folder that a client loads as it walks: the .pvs file, and the model in chunks by what cells see.
    #[command(
        after_help = "Examples:\n  enfilade pack office.pvs --model data/buildings/office.glb -o office\n  enfilade pack level.pvs --model level.map -o level --json"
    )]
    Pack(commands::pack::Args),
    /// Compute the visibility of a level with ready portals: a .prt, or a Quake .bsp, with rows written back.
    #[command(
        after_help = "Examples:\n  enfilade vis level.bsp\n  enfilade vis level.prt --rows rows.txt --against other.txt"
    )]
    Vis(commands::vis::Args),
    /// Write a page on the visibility in a building or a level: both bounds over time, costs and errors.
    #[command(
        after_help = "Examples:\n  enfilade report data/buildings/office.glb -o office.html\n  enfilade report level.prt --against other.txt"
    )]
    Report(commands::report::Args),
    /// Make a ground from height rasters: tiles, drawn within a stated error in pixels.
    #[command(
        after_help = "Examples:\n  enfilade ground north.tif south.tif -o hills.ground\n  enfilade ground hills.asc -o hills.ground --keep-out data/buildings/office.glb --place 120,2,-40,30"
    )]
    Ground(commands::ground::Args),
    /// Make a seeded test scene.
    #[command(
        after_help = "Examples:\n  enfilade generate office --rooms 40 -o office.glb --facts\n  enfilade generate ground --size 1025 --spacing 2 -o hills.tif"
    )]
    Generate(commands::generate::Args),
}

/// The arguments, or one line on the error.
fn arguments() -> Result<Args, ExitCode> {
    Args::try_parse().map_err(|error| {
        if !error.use_stderr() {
            // Help, or the version.
            error.exit();
        }
        let text = error.render().to_string();
        if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
            // An argument is missing: show the help.
            eprint!("{text}");
            return ExitCode::from(2);
        }
        // The error and a suggestion, without the usage.
        let lines = text.lines().map(str::trim).take_while(|line| !line.starts_with("Usage:"));
        let lines: Vec<&str> = lines.filter(|line| !line.is_empty() && !line.starts_with("For more information")).collect();
        eprintln!("enfilade: {} (try --help)", lines.join(" ").trim_start_matches("error: ").replace(" tip: ", "; "));
        ExitCode::from(2)
    })
}

fn main() -> ExitCode {
    let args = match arguments() {
        Ok(args) => args,
        Err(code) => return code,
    };
    let result = args.command.files().check().and_then(|()| args.command.run());
    match result {
        Ok(commands::Outcome::Done) => ExitCode::SUCCESS,
        Ok(commands::Outcome::Failed) => ExitCode::from(1),
        Err(error) => {
            eprintln!("enfilade: {error}");
            ExitCode::from(2)
        }
    }
}

impl Command {
    /// Files that the command reads and writes.
    fn files(&self) -> commands::files::Files {
        match self {
            Self::Bake(args) => args.files(),
            Self::Check(args) => args.files(),
            Self::Walk(args) => args.files(),
            Self::Info(args) => args.files(),
            Self::Why(args) => args.files(),
            Self::Dump(args) => args.files(),
            Self::Export(args) => args.files(),
            Self::Pack(args) => args.files(),
            Self::Vis(args) => args.files(),
            Self::Report(args) => args.files(),
            Self::Ground(args) => args.files(),
            Self::Generate(args) => args.files(),
        }
    }

    fn run(self) -> Result<commands::Outcome, commands::CliError> {
        match self {
            Self::Bake(args) => commands::bake::run(args),
            Self::Check(args) => commands::check::run(args),
            Self::Walk(args) => commands::walk::run(args),
            Self::Info(args) => commands::info::run(args),
            Self::Why(args) => commands::why::run(args),
            Self::Dump(args) => commands::dump::run(args),
            Self::Export(args) => commands::export::run(args),
            Self::Pack(args) => commands::pack::run(args),
            Self::Vis(args) => commands::vis::run(args),
            Self::Report(args) => commands::report::run(args),
            Self::Ground(args) => commands::ground::run(args),
            Self::Generate(args) => commands::generate::run(args),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;
    use std::path::{Path, PathBuf};

    /// All commands as words, from the root on: `enfilade generate office` has three.
    fn commands() -> Vec<(Vec<String>, clap::Command)> {
        fn below(words: &[String], command: &clap::Command, into: &mut Vec<(Vec<String>, clap::Command)>) {
            let words: Vec<String> = words.iter().cloned().chain([command.get_name().to_owned()]).collect();
            match command.get_subcommands().next() {
                Some(_) => command.get_subcommands().for_each(|command| below(&words, command, into)),
                None => into.push((words, command.clone())),
            }
        }
        let mut all = Vec::new();
        below(&[], &Args::command(), &mut all);
        all
    }

    /// A valid value for an argument that the test doesn't set.
    fn any(command: &str, id: &str) -> &'static str {
        match (command, id) {
            ("ground", "size") => "65",
            ("ground", "spacing") => "1",
            ("why", "from" | "to") => "cell:0",
            (_, "rooms" | "size" | "sections" | "count" | "clusters") => "100",
            _ => "other",
        }
    }

    fn takes_a_path(arg: &clap::Arg) -> bool {
        let kind = arg.get_value_parser().type_id();
        kind == std::any::TypeId::of::<PathBuf>() || kind == std::any::TypeId::of::<commands::bake::ViewCells>()
    }

    /// Every path of a command is checked before its work. The type of a new flag shows whether it is a path.
    #[test]
    fn every_path_of_every_command_is_among_its_files() {
        let mut count = 0;
        for (words, command) in commands() {
            let name = command.get_name();
            for arg in command.get_arguments().filter(|arg| takes_a_path(arg)) {
                let path = "the-file.in-question";
                let mut line = words.clone();
                // Flags that this one requires.
                let beside: &[&str] = match (name, arg.get_id().as_str()) {
                    ("check", "leak") => &["--model", "other"],
                    ("vis", "lost") => &["--against", "other"],
                    _ => &[],
                };
                line.extend(beside.iter().map(ToString::to_string));
                for other in command.get_arguments().filter(|other| other.is_required_set() || *other == arg) {
                    line.extend(other.get_long().map(|long| format!("--{long}")));
                    line.push(if other == arg { path } else { any(name, other.get_id().as_str()) }.to_owned());
                }
                let parsed = Args::try_parse_from(&line).unwrap_or_else(|e| panic!("{line:?}: {e}"));
                assert!(parsed.command.files().name(Path::new(path)), "{line:?}: its files lack {}", arg.get_id());
                count += 1;
            }
        }
        assert!(count > 40, "only {count} paths: this tests nothing");
    }

    /// A flag or an argument as a row of a table.
    #[cfg(feature = "full")]
    fn row(arg: &clap::Arg) -> String {
        let takes_values = arg.get_action().takes_values();
        let value = arg.get_value_names().filter(|_| takes_values).and_then(<[_]>::first).map(ToString::to_string);
        let long = arg.get_long().map(|long| format!("--{long}"));
        let short = arg.get_short().map(|short| format!("-{short},"));
        let name: Vec<String> = [short, long, value].into_iter().flatten().collect();
        let possible: Vec<String> = arg.get_possible_values().iter().map(|v| v.get_name().to_owned()).collect();
        let possible =
            if takes_values && !possible.is_empty() { format!(": {}", possible.join(", ")) } else { String::new() };
        let defaults: Vec<_> = arg.get_default_values().iter().map(|value| value.to_string_lossy()).collect();
        let default =
            if takes_values && !defaults.is_empty() { format!(" [default: {}]", defaults.join(",")) } else { String::new() };
        let help = arg.get_help().map(ToString::to_string).unwrap_or_default();
        // A bar would end the cell.
        let [name, meaning] = [name.join(" "), format!("{}{possible}{default}", help.trim_end_matches('.'))];
        format!("| `{}` | {} |\n", name.replace('|', "\\|"), meaning.replace('|', "\\|"))
    }

    /// The flags of commands as a table, below their headings.
    #[cfg(feature = "full")]
    fn flags(commands: &[clap::Command]) -> String {
        let mut groups: Vec<(String, Vec<String>)> = Vec::new();
        let args = commands.iter().flat_map(clap::Command::get_arguments);
        for arg in args.filter(|arg| arg.get_id() != "help" && arg.get_id() != "version") {
            let (heading, row) = (arg.get_help_heading().unwrap_or_default(), row(arg));
            match groups.iter_mut().find(|group| group.0 == heading) {
                Some((_, rows)) if rows.contains(&row) => (),
                Some((_, rows)) => rows.push(row),
                None => groups.push((heading.to_owned(), vec![row])),
            }
        }
        groups.sort_by_key(|(heading, _)| !heading.is_empty());
        let title = |heading: &str| if heading.is_empty() { String::new() } else { format!("| **{heading}** | |\n") };
        let rows: String = groups.iter().map(|(heading, rows)| title(heading) + &rows.concat()).collect();
        format!("| flag | meaning |\n| --- | --- |\n{rows}")
    }

    /// docs/cli.md has the flags of each command as the program takes them. `ENFILADE_WRITE_DOCS=1 cargo test -p enfilade-cli --features full
    /// --bin enfilade` writes them.
    #[cfg(feature = "full")]
    #[test]
    fn the_page_of_the_command_line_has_all_flags() {
        let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/cli.md");
        let before = std::fs::read_to_string(&page).unwrap();
        let mut text = before.clone();
        for command in Args::command().get_subcommands() {
            let mut kinds: Vec<clap::Command> = command.get_subcommands().cloned().collect();
            if kinds.is_empty() {
                kinds.push(command.clone());
            }
            let begin = format!("<!-- flags of {} -->\n", command.get_name());
            let from = text.find(&begin).unwrap_or_else(|| panic!("docs/cli.md lacks {begin}")) + begin.len();
            let length = text[from..].find("<!-- end of flags -->").unwrap_or_else(|| panic!("{begin} has no end"));
            text.replace_range(from..from + length, &flags(&kinds));
        }
        if std::env::var_os("ENFILADE_WRITE_DOCS").is_some() {
            std::fs::write(&page, &text).unwrap();
        }
        assert!(text == before, "docs/cli.md has other flags than the program; ENFILADE_WRITE_DOCS=1 writes them");
    }

    /// Each command's help ends with two examples, and they parse.
    #[test]
    fn every_help_ends_with_two_examples() {
        for mut command in Args::command().get_subcommands().cloned() {
            let help = command.render_long_help().to_string();
            let lines: Vec<&str> = help.trim_end().lines().rev().take(2).map(str::trim).collect();
            for line in lines {
                assert!(line.starts_with(&format!("enfilade {} ", command.get_name())), "{}: {line}", command.get_name());
                Args::try_parse_from(line.split_whitespace()).unwrap_or_else(|e| panic!("{line}: {e}"));
            }
        }
    }
}
