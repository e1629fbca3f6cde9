# What has to hold before a change lands.
set -e
quadstep fly missions/survey.toml --require largest_error=0.3 --junit out/survey.xml
quadstep campaign campaigns/gusts.toml --require 0.9 --junit out/gusts.xml
