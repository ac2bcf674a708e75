#!/usr/bin/perl
# SPDX-License-Identifier: GPL-3.0-or-later
# Lists mutants of C++ sources for scripts/mutate.sh: file, line number, operator and the changed line, separated by
# tabs. Seeded, at most COUNT of them, spread over the operators.
#   scripts/mutations.pl SEED COUNT FILE...
use strict;
use warnings;

my ($seed, $count, @files) = @ARGV;
srand($seed);

# Each operator turns one match into what it returns. Spaces around binary operators keep template brackets,
# pointers and references out.
my @operators = (
    ['boundary',   qr/ (<=|>=|<|>) /,              sub { my %to = ('<' => '<=', '<=' => '<', '>' => '>=', '>=' => '>'); " $to{$1} " }],
    ['equality',   qr/ (==|!=) /,                  sub { $1 eq '==' ? ' != ' : ' == ' }],
    ['sign',       qr/(?<=[\w\)\]]) ([+-]) /,      sub { $1 eq '+' ? ' - ' : ' + ' }],
    ['factor',     qr/(?<=[\w\)\]]) ([*\/]) (?=[\w\(])/, sub { $1 eq '*' ? ' / ' : ' * ' }],
    ['logic',      qr/ (&&|\|\|) /,                sub { $1 eq '&&' ? ' || ' : ' && ' }],
    ['not',        qr/(?<=[\s\(])!(?=[\w\(\*])/,   sub { '' }],
    ['truth',      qr/\b(true|false)\b/,           sub { $1 eq 'true' ? 'false' : 'true' }],
    ['constant',   qr/(?<![\w.'"])(\d+)(?=[.\w]*)(?![\w'])/, sub { $1 + 1 }],
    ['extreme',    qr/\bstd::(min|max)\b/,         sub { $1 eq 'min' ? 'std::max' : 'std::min' }],
    ['assignment', qr/ (\+=|-=|\|=) /,             sub { ' = ' }],
    ['removal',    qr/^(\s+)(?!return\b|const\b|auto\b|break\b|continue\b|using\b|case\b)[\w.\->:\[\]]+(?:\(.*\)| [-+|&]?= [^{]*);$/, sub { "$1;" }],
    ['condition',  qr/\bif \((.*)\) (?=\w|\{$)/,   sub { "if (!($1)) " }],
);

my %found;
for my $file (@files) {
    open(my $source, '<', $file) or die "$file: $!";
    my $number = 0;
    while (my $line = <$source>) {
        ++$number;
        chomp $line;
        (my $code = $line) =~ s{\s*//.*$}{};
        next if $code =~ /^\s*(#|$|\}|static_assert|namespace|using|template)/ or $code =~ /["']/;
        for my $operator (@operators) {
            my ($name, $pattern, $change) = @$operator;
            while ($code =~ /$pattern/g) {
                my ($from, $to) = ($-[0], $+[0]);
                my $mutant = substr($code, 0, $from) . $change->() . substr($code, $to);
                push @{$found{$name}}, join("\t", $file, $number, $name, $mutant) if $mutant ne $code;
            }
        }
    }
}

my @names = sort keys %found;
for my $name (@names) {
    my $list = $found{$name};
    for (my $i = @$list - 1; $i > 0; --$i) {
        my $j = int(rand($i + 1));
        @$list[$i, $j] = @$list[$j, $i];
    }
}
# In turns, so that frequent operators do not crowd out the others.
while ($count > 0 and grep { @{$found{$_}} } @names) {
    for my $name (@names) {
        next unless $count > 0 and @{$found{$name}};
        print shift(@{$found{$name}}), "\n";
        --$count;
    }
}
