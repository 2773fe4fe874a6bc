# Completion of `tandem` in fish: `source scripts/completion.fish`. The program itself answers what
# may stand there: `tandem __complete WORD…`.
function __tandem_complete
    set -l words (commandline -opc)
    set -l typed (commandline -ct)
    for line in ($words[1] __complete $words[2..-1] "$typed" 2>/dev/null)
        if test "$line" = :files
            __fish_complete_path "$typed"
        else
            echo $line
        end
    end
end
complete -c tandem -f -a '(__tandem_complete)'
