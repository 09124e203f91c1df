"""What commands share on the screen: tables, verdicts, progress, options. The only modules, beside the commands, that know a terminal."""
