!! Stops and friction elements of any scene, which says where they act: keys of friction, laws, where a normal force comes from.
module razy_scenes_contacts
   use razy_contact_friction_law, only: new_friction_law
   use razy_core_error, only: error_t
   use razy_core_kinds, only: wp
   use razy_core_number, only: to_text
   use razy_core_text, only: did_you_mean, position_of, string_t
   use razy_core_tone, only: tone_from_waveform
   use razy_core_waveform, only: polyline, waveform_t
   use razy_input_input, only: input_t
   use razy_input_schema, only: add_real, add_string, group_spec_t, nonnegative, positive
   use razy_machine_machine, only: contact_t, machine_t
   use razy_scenes_gap_laws, only: add_gap_law_keys, read_gap_law
   use razy_scenes_harmonics, only: add_waveform, harmonics_t
   use razy_scenes_scene, only: scene_t, site_t
   use razy_scenes_shapes, only: add_course, is_shaped
   use razy_scenes_tables, only: curved, new_curved_law
   implicit none(type, external)
   private

   public :: add_friction_keys, add_ring_keys, contacts_of, read_contacts

contains

   !> Add the keys of the law and of the normal force to `&friction`.
   subroutine add_friction_keys(schema)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)

      call add_real(schema, "static_coefficient", "coefficient of friction while sticking", rule=nonnegative, required=.true.)
      call add_real(schema, "kinetic_coefficient", "coefficient while sliding, or what it falls to; the static one if not given", &
                    rule=nonnegative)
      call add_real(schema, "decay", "how fast the coefficient falls with the speed v of sliding: kinetic + (static - "// &
                    "kinetic)/(1 + decay*v); 0: kinetic while sliding", unit="s/m or s/rad", rule=nonnegative, default="0.0")
      call add_string(schema, "decay_law", "whether it falls so, or after Stribeck by exp(-decay*v) in the place of 1/(1 + "// &
                      "decay*v)", choices=["hyperbolic ", "exponential"], default="hyperbolic")
      call add_real(schema, "viscous_coefficient", "what viscous_coefficient*v adds to the coefficient while sliding; with a "// &
                    "constant normal force a &damper beside does the same, by 'exact' too", unit="s/m or s/rad", &
                    rule=nonnegative, default="0.0")
      call add_real(schema, "normal_load", "constant normal force", unit="N or N m", rule=nonnegative)
      call add_string(schema, "normal_contact", "name of a stop or ring whose force is the normal force, beside normal_load")
      call add_string(schema, "only_with", "name of a stop; there is friction only while it is closed")
      call add_real(schema, "belt_speed", "velocity of the second surface beside that of its body", unit="m/s or rad/s", &
                    default="0.0")
   end subroutine add_friction_keys

   !> Add the keys that `&ring` has beside its ends.
   subroutine add_ring_keys(schema)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)

      call add_real(schema, "clearance", "radial gap all round where both are concentric", unit="m", rule=positive, &
                    required=.true.)
      call add_real(schema, "offset", "where the centre of the hole is in the reference position, from the first end, across "// &
                    "its axis", unit="m", count=2, default="0.0, 0.0")
      call add_gap_law_keys(schema)
   end subroutine add_ring_keys

   !> How many contacts there are beside gear meshes: stops, rings, springs and dampers that are not linear, friction.
   integer function contacts_of(input)
      type(input_t), intent(in) :: input

      contacts_of = input%count("stop") + input%count("ring") + input%count("friction") + &
                    size(curved(input, "spring")) + size(curved(input, "damper"))
   end function contacts_of

   !> Stops, rings, springs and dampers that are not linear, which follow the `meshes` gear meshes of the machine, and friction
   !> elements, which are its last contacts.
   subroutine read_contacts(machine, scene, meshes, input, harmonics, error)
      type(machine_t), intent(inout) :: machine
      class(scene_t), intent(in) :: scene
      integer, intent(in) :: meshes
      type(input_t), intent(in) :: input
      type(harmonics_t), intent(inout) :: harmonics
      type(error_t), allocatable, intent(out) :: error

      integer :: i, rings, stops

      stops = input%count("stop")
      rings = input%count("ring")
      call read_all("stop", [(i, i=1, stops)], meshes)
      call read_all("ring", [(i, i=1, rings)], meshes + stops)
      call read_all("spring", curved(input, "spring"), meshes + stops + rings)
      call read_all("damper", curved(input, "damper"), meshes + stops + rings + size(curved(input, "spring")))
      call read_all("friction", [(i, i=1, input%count("friction"))], size(machine%contact) - input%count("friction"))

   contains

      !> These `numbers` of a group, as the contacts after number `first`.
      subroutine read_all(group, numbers, first)
         character(*), intent(in) :: group
         integer, intent(in) :: numbers(:), first

         type(site_t) :: site
         integer :: k, stop

         stop = 0
         do k = 1, size(numbers)
            if (allocated(error)) return
            associate (contact => machine%contact(first + k), number => numbers(k))
               if (group == "friction") call read_friction(contact, machine%contact(meshes + 1:meshes + stops + rings), input, &
                                                           number, stop, error)
               if (.not. allocated(error)) call scene%find_site(site, input, group, number, stop, error)
               if (allocated(error)) return
               select case (group)
               case ("friction")
                  if (contact%normal_of > 0) contact%normal_of = contact%normal_of + meshes
                  if (contact%only_with > 0) contact%only_with = contact%only_with + meshes
                  contact%drive = contact%drive + site%drive
                  contact%drive_rate = site%drive_rate
               case ("spring", "damper")
                  contact%name = group//" "//to_text(number)
                  call new_curved_law(contact%law, input, group, number, error)
                  if (.not. allocated(error)) call add_memory(contact, harmonics, size(machine%load) + first + k)
               case default
                  call read_stop(contact, site, input, group, number, harmonics, size(machine%load) + first + k, error)
               end select
               if (allocated(error)) return
               if (input%given(group, number, "name")) call input%get(group, number, "name", contact%name)
               contact%w = site%w
               if (allocated(site%frame)) contact%frame = site%frame
               contact%unit = trim(merge("rad", "m  ", site%turns))
               contact%force_unit = trim(merge("N m", "N  ", site%turns))
            end associate
         end do
      end subroutine read_all

   end subroutine read_contacts

   !> Where the slider of a spring stands, if its law remembers that: a tone that stands still, with the error of the contact in
   !> row `row` of the harmonics.
   subroutine add_memory(contact, harmonics, row)
      type(contact_t), intent(in) :: contact
      type(harmonics_t), intent(inout) :: harmonics
      integer, intent(in) :: row

      type(waveform_t) :: wave
      real(wp) :: factor
      integer :: k

      if (.not. contact%law%remembers) return
      call polyline(wave, factor, [0.0_wp], [0.0_wp], [0.0_wp], 0.0_wp)
      associate (home => contact%law%branch(contact%law%home))
         call add_waveform(harmonics, tone_from_waveform(wave), [(0.0_wp, k=2, row), -home%guard(1)%upper])
      end associate
   end subroutine add_memory

   !> `&stop` or `&ring` number i; the motion of a stop's second end goes to row `row` of the harmonics.
   subroutine read_stop(contact, site, input, group, i, harmonics, row, error)
      type(contact_t), intent(inout) :: contact
      type(site_t), intent(in) :: site
      type(input_t), intent(in) :: input
      character(*), intent(in) :: group
      integer, intent(in) :: i, row
      type(harmonics_t), intent(inout) :: harmonics
      type(error_t), allocatable, intent(out) :: error

      real(wp) :: clearance
      integer :: k

      call input%get(group, i, "clearance", clearance)
      if (all(site%sides) .and. clearance < 0.0_wp) then
         call input%complain(error, group, i, "clearance", "at least 0 for a stop with side = 'both'")
      else if (allocated(site%frame)) then
         if (input%choice(group, i, "law") == "rigid") then
            call input%complain(error, group, i, "law", "one that gives way, such as 'kelvin_voigt', in a ring")
         end if
      end if
      if (allocated(error)) return
      if (.not. site%sides(2)) contact%force_sign = -1.0_wp
      ! A ring has no damping_factor.
      call read_gap_law(contact%law, input, group, i, site%sides, [-clearance, clearance], site%turns, &
                        input%number(group, i, "damping_factor", otherwise=0.0_wp), error)
      if (allocated(error) .or. group /= "stop") return
      if (is_shaped(input, group, i, "motion_") .and. contact%law%impacts) then
         call input%complain(error, group, i, "law", "one that gives way, or a sine: the speed of a shape jumps")
         return
      end if
      call add_course(harmonics, [(0.0_wp, k=2, row), -1.0_wp], .true., input, group, i, "motion_", "m or rad", error)
   end subroutine read_stop

   !> Law, normal force and belt of `&friction` number i. `stops` are the contacts that may give a normal force; `normal_of` and
   !> `only_with` count from the first of these. `stop` is the one that the element rubs on: it gives the normal force, or else says
   !> when there is friction; 0: none.
   subroutine read_friction(contact, stops, input, i, stop, error)
      type(contact_t), intent(inout) :: contact
      type(contact_t), intent(in) :: stops(:)
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      integer, intent(out) :: stop
      type(error_t), allocatable, intent(out) :: error

      real(wp) :: decay, kinetic, static

      stop = 0
      call input%get("friction", i, "static_coefficient", static)
      kinetic = input%number("friction", i, "kinetic_coefficient", otherwise=static)
      call input%get("friction", i, "decay", decay)
      contact%drive = -input%number("friction", i, "belt_speed")
      if (kinetic > static) then
         call input%complain(error, "friction", i, "kinetic_coefficient", "at most the static coefficient")
      else if (decay > 0.0_wp .and. .not. input%given("friction", i, "kinetic_coefficient")) then
         call input%complain(error, "friction", i, "kinetic_coefficient", "required with a decay: what the coefficient falls to")
      else if (.not. (input%given("friction", i, "normal_load") .or. input%given("friction", i, "normal_contact"))) then
         call input%complain(error, "friction", i, "normal_load", &
                             "required: the normal force in N or N m, or a stop that gives it as normal_contact")
      else
         call input%refuse_alone(error, "friction", i, "decay_law", "decay")
      end if
      if (allocated(error)) return
      call input%get("friction", i, "normal_load", contact%normal)
      call find_stop("normal_contact", contact%normal_of)
      if (.not. allocated(error)) call find_stop("only_with", contact%only_with)
      if (allocated(error)) return
      contact%law = new_friction_law(static, kinetic, decay, input%choice("friction", i, "decay_law") == "exponential", &
                                     input%number("friction", i, "viscous_coefficient"))
      stop = merge(contact%normal_of, contact%only_with, contact%normal_of > 0)

   contains

      !> The stop that `key` names; 0 if it is not given.
      subroutine find_stop(key, place)
         character(*), intent(in) :: key
         integer, intent(out) :: place

         type(string_t) :: known(size(stops))
         character(:), allocatable :: name
         integer :: k

         place = 0
         if (.not. input%given("friction", i, key)) return
         call input%get("friction", i, key, name)
         do k = 1, size(stops)
            known(k)%text = stops(k)%name
         end do
         place = position_of(name, known)
         if (place == 0) call input%complain(error, "friction", i, key, "the name of a stop or ring; "// &
                                             did_you_mean(name, known, "stops"))
      end subroutine find_stop

   end subroutine read_friction

end module razy_scenes_contacts
