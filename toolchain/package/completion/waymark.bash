# SPDX-License-Identifier: Apache-2.0
# Made by toolchain/package/help.py from --help.
_waymark() {
  local word=${COMP_WORDS[COMP_CWORD]} command=${COMP_WORDS[1]:-} words= more=
  COMPREPLY=()
  if [ "$COMP_CWORD" -eq 1 ]; then
    mapfile -t COMPREPLY < <(compgen -W 'run replay record watch check doctor stamps config causes export mavlink suggest vda5050 batch bench calibrate compare detect diff eval hil import init map mine play reference report simulate web --help --version' -- "$word")
    return
  fi
  case $command in
    calibrate) [ "$COMP_CWORD" -eq 2 ] && more='import mounting camera' ;;
    map) [ "$COMP_CWORD" -eq 2 ] && more='merge version make check survey add-landmark look print-markers' ;;
  esac
  case "$command ${COMP_WORDS[2]:-}" in
    "calibrate import") words='--help --name --model --size --lens --out' ;;
    "calibrate mounting") words='--help --config --run --camera --map' ;;
    "calibrate camera") words='--help --camera --chessboard --aprilgrid --charuco --dictionary --square --second --second-name --floor --tag --gap --model --every --most --name --picture --out' ;;
    "map merge") words='--help --out --site --surveyed --one-frame --by-place --author --note --json' ;;
    "map version") words='--help --author --note --list --use --keep --add --remove' ;;
    "map make") words='--help --resolution --origin --inside --walls-below --negate --fine --speck --clearance --out' ;;
    "map check") words='--help --recording --draw' ;;
    "map survey") words='--help --poses --out --json' ;;
    "map add-landmark") words='--help --id --picture --at --sigma --size --yaw --from --corners --calibration --camera' ;;
    "map look") words='--help --picture --calibration --camera --pose --sigma --sigma-deg --mounting-deg --draw' ;;
    "map print-markers") words='--help --family --ids --size --paper --out' ;;
  esac
  [ -n "$words" ] || case "$command" in
    "run") words='--config --recording --out --record --force --out-max-mb --duration --speed --seed --resume --landmarks --map --calibration' ;;
    "replay") words='--config --out --seed --landmarks --calibration --map --frames-of --timing-of --from --until --lost --force --reference' ;;
    "record") words='--config --out --duration --max-mb --free-mb' ;;
    "watch") words='--url --prefix --duration --once --metrics --log --foxglove' ;;
    "check") words='--landmarks --calibration --map --json --quick --apply' ;;
    "doctor") words='--json --seconds' ;;
    "stamps") words='' ;;
    "config") words='--schema --config --good-for --within --keep --untried' ;;
    "causes") words='--help --landmarks --calibration --map --clocks-apart --apply --json' ;;
    "export") words='--help --mcap --recording --pictures --can --force' ;;
    "mavlink") words='--help --link --as --frame --north --zero --origin --rate --take --system --component --url --prefix --duration' ;;
    "suggest") words='--help --out --against --only --from --to --minutes --json' ;;
    "vda5050") words='--help --broker --manufacturer --serial --site --commands --rate --state-every --interface --password-file --ca --factsheet --max-mb --url --prefix --duration' ;;
    "batch") words='--help --out --jobs --part --list' ;;
    "bench") words='--help --board --table --out --minutes --name' ;;
    "calibrate") words='--help --name --model --size --lens --out --config --run --camera --map --chessboard --aprilgrid --charuco --dictionary --square --second --second-name --floor --tag --gap --every --most --picture' ;;
    "compare") words='--help --out --json --alpha --tolerate --no-reports' ;;
    "detect") words='--help --detector --config --set --out --draw --rate --camera --calibration --landmarks --poses --every' ;;
    "diff") words='--help' ;;
    "eval") words='--help --json --published --reference --align --against --take-out-delay --from --to --detector --camera --sizes --size-min --view' ;;
    "hil") words='--help --config --guest --host --local --out --faults --limits --from --until --can --ssh --record --program --package --mips --played --compare --json' ;;
    "import") words='--help --out --camera --stamps --begin-ns --quality' ;;
    "init") words='--help --motion --dbc --can-log --can --imu --gnss --sender-clock --wheel-radius --ticks --track --wheelbase --steering-ratio --tag-size --sees --camera --calibration --sensor --urdf --frame --mounting --tag-layout --tag-family --landmarks --map --stream --yes --force' ;;
    "map") words='--help --out --site --surveyed --one-frame --by-place --author --note --json --list --use --keep --add --remove --resolution --origin --inside --walls-below --negate --fine --speck --clearance --recording --draw --poses --id --picture --at --sigma --size --yaw --from --corners --calibration --camera --pose --sigma-deg --mounting-deg --family --ids --paper' ;;
    "mine") words='--help --out --within --all --jobs --json' ;;
    "play") words='--config --can --camera --lcm --channel-prefix --speed --loop --from --until --faults --start-at --json --print-faults --print-streams --print-kinds' ;;
    "reference") words='--help --map --range --particles --passes --seed' ;;
    "report") words='--help --out --svg --style' ;;
    "simulate") words='--help --out --seed --landmarks --laps --duration --no-video --frame --png --camera --contact-sheet --perfect' ;;
    "web") words='--help --recording --map --listen --url --prefix --pictures --edit --drive --duration' ;;
  esac
  if [[ $word == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "$words --help" -- "$word")
  elif [ -n "$more" ]; then
    mapfile -t COMPREPLY < <(compgen -W "$more" -- "$word")
  else
    mapfile -t COMPREPLY < <(compgen -f -- "$word")
  fi
}
complete -o filenames -F _waymark waymark
