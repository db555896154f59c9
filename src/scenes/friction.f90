!! Dry friction as an input names it, for every scene: its keys, its law, and where its normal force comes from.
module razy_scenes_friction
   use razy_contact_friction_law, only: new_friction_law
   use razy_core_error, only: error_t
   use razy_input_input, only: input_t
   use razy_core_kinds, only: wp
   use razy_input_schema, only: key_real, key_spec_t, key_string, nonnegative
   use razy_core_text, only: append_text, did_you_mean, lower, string_t
   use razy_machine_machine, only: contact_t
   implicit none(type, external)
   private

   public :: friction_keys, read_friction, stop_of

contains

   !> The keys of the law and of the normal force, for the schema of `&friction`.
   function friction_keys() result(specs)
      type(key_spec_t), allocatable :: specs(:)

      specs = [ &
              key_real("static_coefficient", "coefficient of friction while sticking", rule=nonnegative, required=.true.), &
              key_real("kinetic_coefficient", "coefficient while sliding, or what it falls to; the static one if not given", &
                       rule=nonnegative), &
              key_real("decay", "how fast the coefficient falls with the speed v of sliding: kinetic + (static - kinetic)/"// &
                       "(1 + decay*v); 0: kinetic while sliding", unit="s/m or s/rad", rule=nonnegative, default="0.0"), &
              key_real("normal_load", "constant normal force", unit="N or N m", rule=nonnegative), &
              key_string("normal_contact", "name of a stop whose force is the normal force, beside normal_load"), &
              key_string("only_with", "name of a stop; there is friction only while it is closed"), &
              key_real("belt_speed", "velocity of the second surface beside that of its body", unit="m/s or rad/s", default="0.0")]
   end function friction_keys

   !> Law, normal force and belt of `&friction` number i. `stops` are the contacts that may give a normal force, the first of
   !> which is number `first` of the machine.
   subroutine read_friction(contact, stops, first, input, i, error)
      type(contact_t), intent(inout) :: contact
      type(contact_t), intent(in) :: stops(:)
      integer, intent(in) :: first
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      type(error_t), allocatable, intent(out) :: error

      real(wp) :: decay, kinetic, speed, static

      call input%get("friction", i, "static_coefficient", static)
      kinetic = static
      call input%get("friction", i, "kinetic_coefficient", kinetic)
      call input%get("friction", i, "decay", decay)
      call input%get("friction", i, "belt_speed", speed)
      contact%drive = -speed
      if (kinetic > static) then
         call input%complain(error, "friction", i, "kinetic_coefficient", "at most the static coefficient")
      else if (decay > 0.0_wp .and. .not. input%given("friction", i, "kinetic_coefficient")) then
         call input%complain(error, "friction", i, "kinetic_coefficient", "required with a decay: what the coefficient falls to")
      else if (.not. (input%given("friction", i, "normal_load") .or. input%given("friction", i, "normal_contact"))) then
         call input%complain(error, "friction", i, "normal_load", &
                             "required: the normal force in N or N m, or a stop that gives it as normal_contact")
      end if
      if (allocated(error)) return
      call input%get("friction", i, "normal_load", contact%normal)
      call find_stop("normal_contact", contact%normal_of)
      if (allocated(error)) return
      call find_stop("only_with", contact%only_with)
      if (allocated(error)) return
      contact%law = new_friction_law(static, kinetic, decay)

   contains

      !> The contact that `key` names; 0 if it is not given.
      subroutine find_stop(key, place)
         character(*), intent(in) :: key
         integer, intent(out) :: place

         type(string_t), allocatable :: known(:)
         character(:), allocatable :: name
         integer :: k

         place = 0
         if (.not. input%given("friction", i, key)) return
         call input%get("friction", i, key, name)
         allocate (known(0))
         do k = 1, size(stops)
            call append_text(known, trim(stops(k)%name))
            if (lower(stops(k)%name) /= lower(name)) cycle
            place = first - 1 + k
            return
         end do
         call input%complain(error, "friction", i, key, "the name of a stop; "//did_you_mean(name, known, "stops"))
      end subroutine find_stop

   end subroutine read_friction

   !> Number among the stops, the first of which is contact `first`, of the one that the element rubs on: it gives the normal force,
   !> or else says when there is friction; 0: none.
   pure function stop_of(contact, first) result(stop)
      type(contact_t), intent(in) :: contact
      integer, intent(in) :: first
      integer :: stop

      stop = contact%normal_of
      if (stop == 0) stop = contact%only_with
      if (stop > 0) stop = stop - first + 1
   end function stop_of

end module razy_scenes_friction
