//! The table, and the hold-out that fits it.

use super::Draft;
use crate::page::{Page, toml_float, toml_list, toml_path, toml_string};
use crate::roles::Role;
use crate::sockets::Sockets;

/// More cavities than this are a board rather than a few sockets.
const FEW_SOCKETS: usize = 9;

impl Draft<'_> {
    pub fn table(&mut self) {
        let known = self.known;
        if let (Some(sockets), None) = (&known.sockets, known.board) {
            let path = self.beside("-sockets.toml", sockets_toml(sockets));
            self.page.section("[table]");
            let visits: Vec<String> = sockets.visits.iter().map(usize::to_string).collect();
            let why = format!(
                "no sensor sees the tip; it came back to {} places in other postures ({} pauses), within {:.1} mm by the nominal arm",
                visits.len(),
                visits.join(", "),
                sockets.scatter_m * 1e3
            );
            self.page.line(&format!("board = {}", toml_path(&path, &self.folder)), &why);
            self.page.line("pose = \"estimated\"", "one pose a recording, unknown");
            self.page.section("[table.association]");
            let names: Vec<&str> = sockets.board.cavities.iter().map(|c| c.name.as_str()).collect();
            self.page.line(
                &format!("visiting_order = {}", toml_list(&names)),
                "in the order of their first visit in every recording",
            );
            if names.len() > 1 {
                self.unsure.push(format!(
                    "the size of the fixture: {} is written with the distances at which the calibration errs least; a drawing is better",
                    path.file_name().unwrap_or_default().to_string_lossy()
                ));
            }
            self.unseen.push(
                "tolerances of the sockets: cavity_sigma_mm and seat_sigma_mm of the fixture are assumed"
                    .to_owned(),
            );
            return;
        }
        let Some((path, board)) = known.board else {
            if known.of_role(Role::Tip).is_some() {
                self.unseen.push("a board: give --board FILE if the tip sat in its cavities; only what the sensor sees is used now".to_owned());
            }
            return;
        };
        self.page.section("[table]");
        self.page.line(
            &format!("board = {}", toml_path(path, &self.folder)),
            &format!("given: {} cavities", board.cavities.len()),
        );
        match &known.seats {
            Some(seats) => {
                self.page.line("pose = \"measured\"", &seats.why);
                if !seats.turned.is_empty() {
                    self.page.line(
                        "markers_on = \"frame\"",
                        "the body stands still while the board is tilted on it",
                    );
                }
                let names = seats.unfit.iter().map(|r| known.read.recordings[*r].name.as_str());
                let unfit: Vec<&str> = names.collect();
                if !unfit.is_empty() {
                    self.unsure.push(format!(
                        "cavities do not fit the pauses in {}: if the markers are on the frame below a tilting mechanism, set \
                         markers_on = \"frame\" and declare tilt",
                        unfit.join(", ")
                    ));
                }
            }
            None => {
                let why = match known.cast.iter().any(|c| matches!(c.role, Role::Still | Role::Table)) {
                    true => "in the frame of no body that stands still are cavities where the tip paused",
                    false => "nothing sees the board: one pose a recording, fitted with the arm",
                };
                self.page.line("pose = \"estimated\"", why);
                if board.cavities.len() <= FEW_SOCKETS {
                    self.page.section("[table.association]");
                    let names: Vec<&str> = board.cavities.iter().map(|c| c.name.as_str()).collect();
                    self.page.line(
                        &format!("visiting_order = {}", toml_list(&names)),
                        "assumed: as the board file has them",
                    );
                    self.unsure.push(format!(
                        "the order of the visits, taken from {}: visiting_order",
                        path.display()
                    ));
                }
            }
        }
    }

    pub fn holdout(&mut self) {
        let known = self.known;
        let (recordings, pauses) = (known.read.recordings.len(), known.pauses());
        let of_board = known.board.map(|(_, b)| b.cavities.len());
        let cavities = of_board.or(known.sockets.as_ref().map(|s| s.board.cavities.len()));
        self.page.section("[holdout]");
        match cavities {
            Some(few) if few <= FEW_SOCKETS && recordings > 1 => {
                self.page.line(
                    "kind = \"each-recording\"",
                    &format!("{few} places cannot be parted: one placement left out in turn"),
                );
            }
            Some(few) if few <= FEW_SOCKETS => {
                self.page.line(
                    "kind = \"random\"",
                    &format!("{few} places and one recording cannot be parted: some postures are left out"),
                );
                self.page.line("share = 0.2", "");
                self.page.line("seed = 1", "");
            }
            Some(_) => {
                self.page.line(
                    "kind = \"cavity-folds\"",
                    "a fifth of the cavities held out, in turn: each is predicted once, unseen",
                );
                self.page.line("k = 5", "");
            }
            None => {
                self.page.line(
                    "kind = \"cavity-folds\"",
                    "without a table every pose is a group of its own: each is predicted once",
                );
                let k = if pauses >= 100 { 10 } else { 5.min(pauses / 2) };
                self.page.line(&format!("k = {k}"), &format!("of {pauses} pauses"));
            }
        }
    }
}

fn sockets_toml(sockets: &Sockets) -> String {
    let mut page = Page::default();
    page.note("armcal.board/1, proposed by `armcal init`: places that the tip came back to, in the order of their first visit.");
    page.note("Distances are those at which the calibration errs least; put the drawing's in their place.");
    page.line("name = \"sockets\"", "");
    let mm = |m: f64| toml_float(m * 1e3, 3);
    page.line(
        &format!("cavity_sigma_mm = {}", mm(sockets.board.cavity_sigma_m)),
        "assumed: tolerance of a socket's position, per axis",
    );
    page.line(
        &format!("seat_sigma_mm = {}", mm(sockets.board.seat_sigma_m)),
        "assumed: clearance of the tip in a socket, per visit and axis",
    );
    for (cavity, visits) in sockets.board.cavities.iter().zip(&sockets.visits) {
        page.section("[[cavities]]");
        page.line(&format!("name = {}", toml_string(&cavity.name)), "");
        let at: Vec<String> = cavity.in_board_m.iter().map(|m| toml_float(m * 1e3, 2)).collect();
        page.line(&format!("xyz_mm = [{}]", at.join(", ")), &format!("{visits} pauses"));
    }
    page.text()
}
