//! What was aimed at, and what the numbers say of it.

use super::csv::Kept;
use crate::study::table::Table;

struct Target {
    work: &'static str,
    wanted: Wanted,
    /// Where, and what is reached there.
    reached: Vec<(String, f64)>,
}

#[derive(Clone, Copy)]
enum Wanted {
    AtLeast(f64),
    AtMost(f64),
}

impl Wanted {
    fn is_met(self, reached: f64) -> bool {
        match self {
            Self::AtLeast(wanted) => reached >= wanted,
            Self::AtMost(wanted) => reached <= wanted,
        }
    }

    fn in_words(self) -> String {
        match self {
            Self::AtLeast(wanted) => format!("at least {wanted}"),
            Self::AtMost(wanted) => format!("at most {wanted}"),
        }
    }
}

/// `peers` is peers.csv, `ours` bench.csv.
pub fn table(peers: &Kept, ours: &Kept) -> Table {
    let head = vec!["work", "target, as a ratio", "reached", "met"];
    let rows = targets(peers, ours).into_iter().map(|target| {
        let reached: Vec<String> =
            target.reached.iter().map(|(place, reached)| format!("{reached:.3} ({place})")).collect();
        let met = target.reached.iter().filter(|(_, reached)| target.wanted.is_met(*reached)).count();
        let met = match (met, target.reached.len()) {
            (_, 0) => "not measured".to_owned(),
            (met, all) if met == all => "yes".to_owned(),
            (0, _) => "**no**".to_owned(),
            (met, all) => format!("**{met} of {all}**"),
        };
        vec![target.work.to_owned(), target.wanted.in_words(), reached.join("; "), met]
    });
    Table { head, rows: rows.collect() }
}

fn targets(peers: &Kept, ours: &Kept) -> Vec<Target> {
    let against = |work: &'static str, in_work: &str, program: &str, wanted: f64| Target {
        work,
        wanted: Wanted::AtLeast(wanted),
        reached: ratios(peers, in_work, program),
    };
    let mut targets = vec![
        against("dense bake against FCPW (nearest points, its signs wrong near edges)", "dense", "FCPW", 12.0),
        against("dense bake against parry3d", "dense", "parry3d", 20.0),
        against("dense bake against Open3D", "dense", "Open3D", 30.0),
        against("dense bake against libigl, fast winding number", "dense", "libigl fast winding number", 30.0),
        against("dense bake against Warp, winding number", "dense", "Warp winding number", 30.0),
        against("sparse bake ±3 voxels against OpenVDB's meshToLevelSet", "sparse ±3", "OpenVDB meshToLevelSet", 10.0),
    ];
    targets.extend(of_contacts(peers));
    targets.extend(of_threads(ours));
    let commands =
        |work: &'static str, wanted: f64, which: &str, measure: fn(&Kept, &[String]) -> Option<f64>| Target {
            work,
            wanted: Wanted::AtMost(wanted),
            reached: of_rows(
                ours,
                |kept, row| kept.cell(row, "group") == "commands" && kept.cell(row, "work").starts_with(which),
                measure,
            ),
        };
    targets.extend([
        commands("memory of a dense bake, over grid and mesh", 1.2, "bake dense", |kept, row| {
            Some(kept.number(row, "peak_mib")? / kept.number(row, "result_mib")?)
        }),
        commands("memory of a sparse bake, over its samples and mesh", 1.3, "bake sparse", |kept, row| {
            Some(kept.number(row, "peak_mib")? / kept.number(row, "result_mib")?)
        }),
        commands("contacts as a whole command, over its query", 3.0, "contacts", |kept, row| {
            Some(kept.number(row, "seconds")? / kept.number(row, "floor_seconds")?)
        }),
    ]);
    let reading = peers.words("work").into_iter().find(|work| work.starts_with("OBJ"));
    targets.push(Target {
        work: "reading an OBJ file against tobj",
        wanted: Wanted::AtLeast(5.0),
        reached: reading.map_or(vec![], |work| ratios(peers, &work, "tobj")),
    });
    targets
}

/// Of a program in all rows of a work: its time over ours.
fn ratios(peers: &Kept, work: &str, program: &str) -> Vec<(String, f64)> {
    of_rows(&peers.with(&[("work", work), ("program", program)]), |_, _| true, |kept, row| kept.number(row, "ratio"))
}

fn of_rows(
    kept: &Kept,
    is_wanted: impl Fn(&Kept, &[String]) -> bool,
    measure: impl Fn(&Kept, &[String]) -> Option<f64>,
) -> Vec<(String, f64)> {
    let wanted = kept.rows.iter().filter(|row| is_wanted(kept, row));
    wanted.filter_map(|row| Some((place(kept, row), measure(kept, row)?))).collect()
}

fn place(kept: &Kept, row: &[String]) -> String {
    let what = [kept.cell(row, "mesh"), kept.cell(row, "work")].into_iter().find(|word| !word.is_empty());
    let resolution = kept.cell(row, "resolution");
    let size = if ["", "0"].contains(&resolution) { String::new() } else { format!(", {resolution}") };
    format!("{}{size}", what.unwrap_or_default())
}

fn of_contacts(peers: &Kept) -> Vec<Target> {
    let contacts = peers.with(&[("work", "contacts")]);
    let of = |program: &str| {
        let rows = contacts.with(&[("program", program)]);
        rows.rows.first().and_then(|row| Some((place(&rows, row), rows.number(row, "seconds")?)))
    };
    let over = |slow: &str, fast: &str| {
        let (Some((place, slow)), Some((_, fast))) = (of(slow), of(fast)) else { return vec![] };
        vec![(place, slow / fast)]
    };
    let warp = "Warp kernel; 32 Frank-Wolfe steps";
    let target = |work, wanted, reached| Target { work, wanted, reached };
    vec![
        target("contacts, Frank-Wolfe, against Warp's kernel", Wanted::AtLeast(10.0), over(warp, "sdftool fw")),
        target("contacts, `auto`, against Warp's kernel", Wanted::AtLeast(30.0), over(warp, "sdftool auto")),
        target("contacts, `auto`, over 64 samples", Wanted::AtMost(1.3), over("sdftool auto", "sdftool sample64")),
        target(
            "contacts, Frank-Wolfe, against triangle pairs",
            Wanted::AtLeast(30.0),
            over("parry3d triangle pairs", "sdftool fw"),
        ),
    ]
}

fn of_threads(ours: &Kept) -> Vec<Target> {
    let threads = ours.with(&[("group", "threads")]);
    let reached = threads.words("work").into_iter().filter_map(|work| {
        let of = |count: &str| {
            let rows = threads.with(&[("work", &work), ("threads", count)]);
            rows.rows.first().and_then(|row| rows.number(row, "seconds"))
        };
        Some((work.clone(), of("1")? / of("2")?))
    });
    vec![Target { work: "two threads against one", wanted: Wanted::AtLeast(1.9), reached: reached.collect() }]
}
