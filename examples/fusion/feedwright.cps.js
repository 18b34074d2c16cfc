// Feedwright step for a post of Fusion or HSM: lines for the end of a .cps file.
//
// Call feedwrightHeader() where the post writes its header (in onOpen): it writes stock and tools as comments that Feedwright reads. When
// the program is closed, Feedwright rewrites it beside: 1001.nc → 1001.fw.nc. What the comments do not tell (material, machine, limits)
// stands in 1001.setup.toml beside the program; `feedwright init 1001.nc` drafts it.
//
// Posts may start programs only where they run on this computer, not in the cloud.
var feedwrightPath = "feedwright"; // with its folder where it is not in the PATH

function feedwrightHeader() {
  var number = function (value) {
    return String(Math.round(value * 10000) / 10000);
  };
  var corner = function (at) {
    return "X" + number(at.x) + " Y" + number(at.y) + " Z" + number(at.z);
  };
  var blank = getWorkpiece();
  writeComment("STOCK " + corner(blank.lower) + " " + corner(blank.upper));
  var tools = getToolTable();
  for (var i = 0; i < tools.getNumberOfTools(); ++i) {
    var tool = tools.getTool(i);
    writeComment(
      "T" + tool.number + " D=" + number(tool.diameter) + " CR=" + number(tool.cornerRadius) + " - " +
      tool.numberOfFlutes + " FLUTES " + getToolTypeName(tool.type).toUpperCase()
    );
  }
}

function onTerminate() {
  var program = getOutputPath();
  var code = execute(feedwrightPath, "optimize \"" + program + "\"", false, FileSystem.getFolderPath(program));
  if (code == 1) {
    warning("Feedwright: a limit is not met somewhere; feedwright optimize " + program + " says where.");
  } else if (code != 0) {
    warning("Feedwright wrote no program; feedwright init " + program + " drafts the setup it needs.");
  }
}
