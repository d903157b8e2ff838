//! Help and usage messages.

use crate::folder::{Folder, says};

const COMMANDS: [&str; 14] = [
    "bake", "merge", "contacts", "compare", "eval", "info", "verify", "slice", "surface", "export", "import", "view",
    "simulate", "demo",
];

#[test]
fn help_names_every_command_and_what_the_exit_status_means() {
    let folder = Folder::new();
    let help = folder.done("--help");
    says(
        &help,
        &[
            "OBJ, PLY, STL or OFF",
            ".sdf.h5",
            ".sdf.toml",
            "negative inside",
            "Exit status: 0 done, 1 ",
            "2 wrong usage",
            "128 + N ended by the signal N",
        ],
    );
    says(&help, &COMMANDS.map(|command| format!("\n  {command} ")).each_ref().map(String::as_str));
    says(&folder.done("--version"), &["sdftool 0."]);
}

/// In a debug build clap checks each command that it builds; completions need all of them.
#[test]
fn the_command_line_is_consistent() {
    says(&Folder::new().done("completions bash"), &["--margin"]);
}

#[test]
fn every_command_and_argument_has_a_description() {
    let folder = Folder::new();
    for command in COMMANDS {
        let help = folder.done(&format!("{command} --help"));
        says(&help, &["Usage: sdftool ", "--json", "one JSON object"]);
        // Every argument has a description.
        let mut lines =
            help.lines().skip_while(|line| !line.starts_with("Arguments:") && !line.starts_with("Options:"));
        while let Some(line) = lines.next() {
            if ["  <", "  -", "      --"].iter().any(|start| line.starts_with(start)) {
                let name = line.trim_start();
                let is_described = name.split_once("  ").is_some_and(|(_, words)| !words.trim().is_empty());
                let is_described = is_described
                    || lines.clone().next().is_some_and(|next| next.starts_with("        ") && !next.trim().is_empty());
                assert!(is_described, "{command}: {name} has no description:\n{help}");
            }
        }
        assert!(help.lines().all(|line| line.chars().count() <= 120), "{command}: {help}");
    }
}

#[test]
fn a_wrong_command_line_has_another_exit_status_than_a_wrong_file() {
    let folder = Folder::new();
    for words in [
        "",
        "bakes",
        "bake",
        "bake a.obj b.obj --res 8 --shard 2/2",
        "bake a.obj b.obj --res 8 --jobs 0",
        "bake a.obj --res many",
        "bake a.obj --res 0",
        "bake a.obj --res -1",
        "bake a.obj --res 4294967296",
        "bake a.obj --voxel-size 0",
        "bake a.obj --voxel-size nan",
        "bake a.obj --voxel-size inf",
        "bake a.obj --res 8 --padding -1",
        "bake a.obj --res 8 --threads 0",
        "bake a.obj --res 8 --threads 4000000000",
        "bake a.obj --res 8 --sign guess",
        "bake a.obj --res 8 --layout sparse --colour",
        "contacts a.obj",
        "contacts a.obj b.toml --elements tetrahedra",
        "contacts a.obj b.toml --margin nan",
        "contacts a.obj b.toml --translate 1,2,inf",
        "contacts a.obj b.toml --rotate 1,2,3",
        "eval b.toml",
        "verify b.toml",
        "verify b.toml a.obj --points 0",
        "slice b.toml -o c.png --axis w",
        "slice b.toml -o c.png --at nan",
        "slice b.toml -o c.png --pixels 1000000000",
        "surface b.toml",
        "export b.toml",
        "export b.toml --format vdb",
        "import a.npy --spacing 0",
        "view",
    ] {
        let output = folder.sdftool(words).output().unwrap();
        assert_eq!(output.status.code(), Some(2), "{words}: {}", String::from_utf8_lossy(&output.stderr));
        assert!(output.stdout.is_empty(), "{words}");
    }
    says(&folder.wrong_usage("bake a.obj --voxel-size -1"), &["--voxel-size", "more than 0"]);
    assert_eq!(folder.names(), [] as [&str; 0]);
}

#[test]
fn options_that_nothing_would_use_are_refused() {
    let folder = Folder::new();
    folder.write("sheet.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    folder.write("ball.sdf.toml", "[field]\nshape = 'sphere'\nradius = 1\n");
    for option in ["--rotate-first 0,0,0,1", "--translate-first 0,0,0", "--resolution 0.1"] {
        let line = folder.misused(&format!("contacts sheet.obj ball.sdf.toml {option}"));
        says(&line, &[option.split(' ').next().unwrap(), " needs two fields, but sheet.obj is a mesh: remove it"]);
    }
    for method in ["fw", "pgd", "newton", "sample4", "corners64", "gss --elements edges"] {
        let line = folder.wrong_usage(&format!("contacts sheet.obj ball.sdf.toml --tolerance 0.1 --method {method}"));
        says(&line, &["--tolerance is for auto and certified"]);
    }
    for words in ["", "--method certified", "--all-minima"] {
        folder.done(&format!("contacts sheet.obj ball.sdf.toml --tolerance 0.1 {words}"));
    }
    let line = folder.misused("contacts sheet.obj ball.sdf.toml --exact --tolerance 0.1");
    says(&line, &["--exact has its own method", "remove --tolerance"]);
    says(&folder.wrong_usage("bake sheet.obj --res 8 --certify tight"), &["--certify tight", "--layout sparse"]);
    says(&folder.wrong_usage("view ball.sdf.toml --margin 0.1"), &["not provided", "<MESH>"]);
    folder.done("view ball.sdf.toml sheet.obj --margin 0.1");
}

#[test]
fn a_negative_number_is_refused_by_the_option_that_it_was_given_to() {
    let folder = Folder::new();
    for (words, options) in [
        (
            "bake a.obj",
            "--res --voxel-size --max-error --band --padding --memory --weld --close --threads --jobs --shard",
        ),
        ("contacts a.obj b.toml", "--iterations --tolerance --resolution --threads"),
        ("compare a.obj b.toml", "--tolerance --rounds --threads"),
        ("verify b.toml a.obj", "--points --seed --threads"),
        ("slice b.toml -o c.png", "--pixels"),
        ("surface b.toml -o c.obj", "--res"),
        ("export b.toml", "--res --band --threads"),
        ("import a.npy", "--spacing"),
        ("simulate a.toml", "--frames --threads"),
    ] {
        for option in options.split(' ') {
            let said = folder.wrong_usage(&format!("{words} {option} -1"));
            says(&said, &["invalid value '-1'", &format!("for '{option} <")]);
        }
    }
}

#[test]
fn one_mesh_with_an_option_of_several_is_not_called_several() {
    let folder = Folder::new();
    folder.write("sheet.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    for words in ["--resume -o x.h5", "--jobs 3 -o x.h5", "--out-dir grids -o x.h5", "--resume --view x.html"] {
        let line = folder.misused(&format!("bake sheet.obj --res 8 {words}"));
        says(&line, &["--resume, --jobs and --out-dir do not go with -o", "give --out-dir"]);
    }
    folder.write("other.obj", folder.read("sheet.obj"));
    says(&folder.misused("bake sheet.obj other.obj --res 8 -o x.h5"), &["-o and --view are for one mesh"]);
}

#[test]
fn merge_says_what_a_joined_grid_lacks() {
    says(&Folder::new().done("merge --help"), &["open mesh", "lacks", "`error_regions`"]);
}

#[test]
fn a_negative_number_may_be_written_in_any_way() {
    let folder = Folder::new();
    folder.write("sheet.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    folder.write("ball.sdf.toml", "[field]\nshape = 'sphere'\nradius = 1\n");
    for words in [
        "slice ball.sdf.toml -o s.png --pixels 16 --at",
        "surface ball.sdf.toml -o s.obj --res 16 --level",
        "contacts sheet.obj ball.sdf.toml --margin",
        "compare sheet.obj ball.sdf.toml --rounds 1 --margin",
        "view ball.sdf.toml sheet.obj --margin",
    ] {
        for number in ["-1e-3", "-.1", "-0.1", "-1E-3"] {
            folder.done(&format!("{words} {number}"));
            folder.done(&format!("{words}={number}"));
        }
        says(&folder.wrong_usage(&format!("{words} -x")), &["invalid value '-x'", "is not a finite number"]);
    }
}

#[test]
fn a_part_of_one_mesh_is_not_resumed() {
    let folder = Folder::new();
    folder.write("sheet.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    for words in ["--resume", "--jobs 2", "--resume --jobs 2"] {
        for layout in ["--layout sparse", ""] {
            let said = folder.wrong_usage(&format!("bake sheet.obj --res 8 {layout} --shard 0/2 {words}"));
            says(&said, &["--shard of one mesh", "remove --resume and --jobs", "--out-dir"]);
        }
    }
    folder.done("bake sheet.obj --res 8 --shard 0/2 --resume --out-dir grids");
}

#[test]
fn merge_advises_no_standard_output() {
    let said = Folder::new().wrong_usage("merge a.h5 b.h5 -o c.txt");
    assert!(said.contains("ends in .sdf.h5, .h5 or .hdf5") && !said.contains("standard output"), "{said}");
}
