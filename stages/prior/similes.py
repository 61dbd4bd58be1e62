"""What says in a roundabout way what an adjective says, as patterns and what they mean."""

from stages.prior.colors import COMMON

TURNED = (r"((?:sun-?|rain-?|smoke-?|age-?)?(?:weathered|greyed|grayed|aged|bleached|darkened|yellowed|seasoned|silvered|"
          r"smoked|tarnished|patinated|oxidi[sz]ed|mellowed|gone|turned|discolou?red|worn|faded|browned|stained|burnished|rubbed|smooth))")
HUES = "|".join(COMMON)
HANDS = ("rain|sun|sunlight|age|time|years|use|decades|centuries|weather|wind|sea|salt air|handling|touch|hands|wear|traffic|"
         "fire|generations|elements|heat|washing|feet|footsteps|sweat")
"""Words of what becomes of a stuff, the colours that it may take, and who does it."""

BELONGINGS = "helmet|sword|shield|hat|crown|armou?r|mask|cloak|robe|staff|boots|chest|axe|hammer|throne|goblet"
"""What somebody has, whose name people write without an apostrophe: "a knights helmet"."""

LIKENESS = (r"\b(?:that )?(?:looks? |gleams? |shines? |glows? |shimmers? )?like an? ([a-z][a-z -]*?)"
            r"(?=$|[,;.]| and | with | on | but )")

WORN_OFF = (r"\b([a-z]+) (paint|enamel|lacquer|glaze) (?:peeling|flaking|chipping|chipped|worn|rubbed|scraped|coming) "
            r"(?:away )?off the ([a-z]+)\b")

NOUNS = r"(?:an? |the )?([a-z' -]+?)(?=$|[,;.:()]| and | with | but | on | in | that | which )"
SIMILES = (
    (r"\bas (?!well|soon|long|much|many|far)([a-z]+(?:-[a-z]+)?) as " + NOUNS, r"\1"),  # "as black as a raven's wing"
    (r"\blike an? (?:(?!with |and |but |on )[a-z]+ ){1,4}?"
     r"(?=(?:in|of|made of|cast in|carved from) )", ""),  # "a ring like a coiled snake in silver"
    (r"\boil[- ]painted\b", "painted"), (r"\bcreosoted\b", "dark brown"),
    (r"\bhalf[- ](?=(?:melted|eaten|peeled|rotten|rotted|burnt|burned|charred|opened|broken|ruined|frozen|faded|rusted)\b)",
     "partly "),
    (r"\b[a-z]+[- ]shaped\b(?! (?:like|as|into))", ""),  # "a leaf shaped blade"
    (r"\b(?:shaped|formed|sculpted|modelled|modeled) (?:like|as|into) " + NOUNS, ""),  # "a jug shaped like a pineapple"
    (r"\bin the (?:shape|form) of " + NOUNS, ""),
    (rf"\b((?:dark |light |pale )?(?:{HUES})) over ((?:dark |light |pale )?(?:{HUES}))(?=$|[,;.]| with | and )",
     r"\2, upper half \1"),  # "a helicopter, red over white"
    (r"\b(?:hanging|dangling|sprouting|rising|protruding|sticking out|hung) (?:from|out of|off) (?=the |its )", "at "),
    (r"(?<=carved )((?:from|out of) [a-z ]+? )with an? [a-z-]+\b", r"\1"),  # "carved from a log with a chainsaw"
    (rf"\b({HUES}) as " + NOUNS, r"\1"),  # "legs black as coal"
    (r"\b(?:(?:in|of|with) )?(?:the )?(?:exact |same |deep |rich |dark |pale )?"
     r"(?:colou?r|shade|hue|tint|tone)(?: and [a-z]+)? of " + NOUNS,
     r"\1 coloured"),  # "the colour of honey"
    (r"\b(?:with|in|and) (?:an? |the )?((?:(?!(?:with|and|or) )[a-z-]+ ){0,3}?[a-z-]+) "
     r"(?:finish|coating|paint job|paintwork|surface|texture|look)\b", r"finished in \1"),
    (r"\b(?:an? )?(?:crackled?|cracked|crazed|craquelure) (?:glaze|glazing)\b", "glaze crackled"),
    (r"(?:,\s*(?:on |against )?|\s(?:on|against) )(?:an? )?(?:plain |clean )?"
     r"(?:white|black|gr[ea]y|dark|neutral|transparent|plain|clean|studio) background\b", ","),
    (r"(?:(?<=with )|(?<=and )|(?<=, )|^)(?:hazard|warning|caution) (?:stripes|striping|tape)\b",
    "yellow and black stripes"),
    (r",? half[- ](?:dipped|submerged|buried) in\b", ", lower half"),
    (r"(?:,| with| in)(?: an?)? ((?:light |dark |medium |warm |deep |rich )?)"
     r"(?!coffee|water|blood|rust|grass|oil|wine|ink|tea|dirt)([a-z]+) stain\b", r", \1\2 coloured"),
    (r"^(?:an? |some )?([a-z ]+?) in an? ((?:[a-z-]+ ){0,3}?)(mug|cup|bowl|tankard|goblet|bucket)\b",
     r"\2\3 with \1 inside"),
    (r"\bin an? ((?:[a-z-]+ ){0,3}?)(pot|planter|plant pot|flower pot|flowerpot|holder|saucer|basket)\b",
     r"with a \1\2 at the lower third"),
    (r"\b(iron|steel|brass|bronze|copper|silver|gold|metal|rope|cord|twine)[- ]bound\b", r"\1 banded"),
    (r"\bpaint-(chipped|peeling|flaking|worn)\b", r"\1 painted"),
    (r"^((?:an? )?(?:(?!high|with|and)[a-z-]+ ){1,4})heels\b", r"\1high heels"),
    (r"\bblack[- ]figure(?: greek)? ([a-z]+)(?!.*figures)", r"\1 of orange clay with black figures"),
    (r"\bred[- ]figure(?: greek)? ([a-z]+)(?!.*figures)", r"\1 of black clay with orange figures"),
    (r"\b(?:stone|acid)[- ]?washed (?=jeans|denim|jacket)", "faded "),
    (r"\b(basket|crate|box|sack|bag|bowl|bucket|barrel|cart|tray|plate|bunch|pile) of "
     r"(?:red|green|yellow|orange|ripe|fresh) (?=[a-z]+s\b)", r"\1 of "),
    (r"\bmoth (?=holes)", ""), (r"\b(?:cat|dog|claw) scratch(?:es)?\b", "scratches"),
    (r"\bwith (?:an? |some |a few |small )*(?:chips?|nicks?) (?:on|in|at|along|around) the ([a-z]+)\b", r"with a chipped \1"),
    (r"\blime[- ]wash(?:ed)?\b(?= (?:brick|stone))", "white"), (r"\blime[- ]wash(?:ed)?\b", "limewashed"),
    (r"\bon (?:the )?(?:north|south|east|west|shady|sunny|far|near|windward|lee|left or right)(?:ern)? side\b", "on one side"),
    (r"\b(cobweb|vine|lichen|barnacle)(?:bed|ed|d|by)\b", r"\1 covered"), (r"\bcandy[- ](?=striped)", ""),
    (r"^(?:an? )?((?:[a-z]+ )*?(?:stone|gem|jewel|diamond|ruby|emerald|sapphire|pearl|opal|amber|jade|crystal)s?) "
     r"set in(?:to)? (?!the )([a-z ]+?)(?=$|[,.;])", r"\2 with \1 studs"),
    (r"\b(?:make|makes|making) (?:it|this|that|them|these) look like an? ", ""),
    (r"\b(?:left|abandoned|allowed|starting|beginning) to rot\b", "rotten"),
    (r"\b(?:leaking|oozing|spilling|seeping|bubbling) (?:from|out of|over) (?=the |its )", "at "),
    (r"\bin (?:bright|vivid|vibrant|many|different|various|mixed|assorted) colou?rs\b", "in rainbow patches"),
    (r"\btopiary (?=(?!bush|tree|hedge)[a-z])", "green leaves "),
    (r"\b(?:to )?look(?:s|ing)? (?:like|as if|as though) (?:it|they|he|she) (?:is|was|were|are)\b", "of"),
    (r"\b(?:burnt|burned|scorched|charred) and blackened\b", "charred"),
    (r"\bblackened (?=at|on|along|around|near|in)", "charred "),
    (r"\b(?:and |but )?(?:worn|rubbed|polished) (?:shiny|smooth|bright)(?: (?:where|from|by) [^,.;]*)?", "with polished edges"),
    (r"(?:^|\ban? )(slice|wedge|segment|half) of (?:an? |the )?([a-z]+)\b", r"\2 \1"),
    (r"\b(?:in|on) an? (?:waffle|sugar|wafer) cone\b|(?<=ice cream) cone\b", " with waffle at the lower half"),
    (r"\b(?:(?:in|with) )?(?:an? )?sunburst(?: finish)?\b", "glossy orange with dark brown edges"),
    (r"\bwith (?:the )?(?:word |words |text )?[\"']?[a-z]+[\"']? (?:stamped|stencill?ed|printed|written|embossed) "
     r"(?:on (?:it|the [a-z]+) )?in ([a-z]+)\b", r"with \1 lettering"),
    (r"(?:,| with| and)(?: (?!thin|gold|silver|copper|brass)[a-z]+){0,2} (?:grout|mortar)(?: lines| joints)?\b"
     r"(?=$|[,.;]| and | with )", ""),
    (r"\bwhite-?washed (?=brick|stone|rock)", "white "),
    (r"\bwhite-?washed (?=[a-z])", "white painted "),
    (r"\brusty (streaks?|stains?|runs|drips|spots|patches|specks)\b", r"rust \1"),
    (r"\bcamouflage in ([a-z]+) (?:tones|colou?rs|shades)\b", r"\1 camouflage"),
    (r"\b(?:flakes|remnants|remains|scraps) of (?=(?:[a-z]+ ){0,3}paint\b)", "peeling "),
    (r"\b(cracks|gaps|seams|grooves|joints|holes|veins|runes|letters|carvings) "
     r"(?:filled|inlaid|repaired|sealed|packed|fixed|mended) (?:with|in) "
     r"([a-z ]+?)(?=$|[,.;]| and | on )", r"\2 \1"),
    (r"\b(?:multi-?colou?red|colou?rful)\b", "rainbow patches"),
    (r"\b(?:bright |in )?(?:the )?primary colou?rs\b", "in red, yellow and blue"),
    (r"\b(?:soft )?pastel colou?rs\b", "pastel pink, pastel blue and pastel yellow"),
    (r"\bautumn(?:al)? (?:colou?rs|tones|shades)\b", "autumn leaves coloured"),
    (r"\b(?:two|2)[- ]ton(?:e|ed) ", ""),
    (r"\bwith (?:an? |the )?(?:wooden |wood )?(?:plank|board|formwork) (?:imprints?|marks|texture|lines)\b", ""),
    (r"\bglowing (cracks|veins|fissures)\b", r"bright orange \1"),
    (r"\b(?:gone|turned) green with (?:verdigris|patina|age)\b", "covered in verdigris"),
    (r"\b(?:blue and white )?(?:delft|willow[- ]pattern|blue willow|chinoiserie)(?:ware)?(?: blue)?(?: pattern)?"
     r"(?: pottery| porcelain| china| ware)? ([a-z]+(?: [a-z]+)?)(?=$|[,.;]| with | on | and )",
     r"\1 in white glazed ceramic with cobalt blue motifs"),
    (r"\b(?:multi)?colou?red (?:chips|specks|flecks)\b", "sprinkles"),
    (r"\bblue and white (?=willow)", ""),
    (r"\bpowder coated\b(?! in| with)", "powder-coated"),
    (r"\b([a-z]+) and ([a-z]+) marbled ([a-z]+(?: [a-z]+)?)(?=$|[,.;]| with | and )", r"\1 \3 swirled with \2"),
    (r"\b([a-z]+) and ([a-z]+) marbled\b", r"\1 and \2 swirled"),
    (r"\b(peeling|flaking|chipping|wearing|coming|crumbling|falling|breaking|cracking|rubbing|scraping|shedding|lifting|curling|"
     r"sloughing|peeled|flaked|crumbled|worn|rubbed|scraped|fallen)(?: away from| away off| off of| off from| from)\b",
     r"\1 off"),
    (rf"\b{TURNED} to (?:an? )?(?=(?:[a-z]+ )?(?:{HUES})\b)", ""),
    (rf"\b{TURNED} (?:by|with|from|in|through) (?:the |many )?(?:{HANDS})(?: and (?:the )?(?:{HANDS}))?\b", r"\1"),
    (rf"\b(?:by|from|through) (?:the |many |years of )?(?:{HANDS})\b", ""),
    (r"\b(copper|brass|bronze)((?: [a-z]+){1,2}) (?:gone|turned|going|turning) (green|turquoise|teal)\b", r"\3 \1\2"),
    (r"\b(?:8|number eight)[ -]?ball\b", "eight ball"),
)
"""What says in a roundabout way what an adjective says."""
