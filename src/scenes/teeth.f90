!! Stiffness and contact ratio of external gears of steel from the data of their teeth, after ISO 6336-1:2006, method B.
!!
!! The data become the stiffness of the mesh, and its contact ratio where pairs are to be in mesh in turn, before the input is
!! checked, so that nothing behind knows of them, and `--check` shows what they have become. With the gear with fewer teeth as
!! number 1, zn = z/cos³β, c' in N/(mm µm) and the normal pressure angle α in degrees,
!!
!!     1/c'th = C1 + C2/zn1 + C3/zn2 + C4 x1 + C5 x1/zn1 + C6 x2 + C7 x2/zn2 + C8 x1² + C9 x2²,
!!     c' = 0.8 c'th CB cos β,   CB = (1 + 0.5 (1.2 - 1.25)) (1 - 0.02 (20 - α)),   cγ = c' (0.75 ε + 0.25)
!!
!! with 0.9 cγ for ε < 1.2: solid wheels, the standard basic rack. So k pairs are (3 k + 1)/4 times as stiff as one.
!! The contact ratio ε is that of the transverse plane, without shortened tips, at the distance of the axes without backlash:
!! inv αw = inv αt + 2 (x1 + x2) tan α/(z1 + z2). Lengths are in transverse modules.
module razy_scenes_teeth
   use razy_core_error, only: error_t
   use razy_core_kinds, only: pi, wp
   use razy_core_number, only: to_text
   use razy_core_text, only: append_text, string_t
   use razy_input_input, only: check_input, input_t
   use razy_input_reader, only: entries_t, indexed, pick, read_entries
   use razy_input_schema, only: add_logical, add_real, group_at, group_spec_t, positive
   implicit none(type, external)
   private

   public :: add_tooth_keys, contact_ratio_of, expand_teeth, refuse_gone, single_stiffness

   !> Keys that are gone once they are expanded; the last ones are those of shafts too, where they stay.
   character(*), parameter :: tooth_data(5) = [character(14) :: "width", "profile_shift", "pairs", "pressure_angle", "helix_angle"]
   integer, parameter :: of_all_scenes = 3

contains

   !> Add the keys to the last group, which is a mesh.
   subroutine add_tooth_keys(schema)
      type(group_spec_t), allocatable, intent(inout) :: schema(:)

 call add_real(schema, "width", "common face width of two external gears of steel, instead of stiffness: that is of ISO 6336-1 "// &
                    "then, from teeth, profile_shift, pressure_angle and helix_angle", unit="m", rule=positive)
      call add_real(schema, "profile_shift", "of both gears, with width; none if not given", low=-1.0_wp, high=2.0_wp, count=2)
      call add_logical(schema, "pairs", "whether width gives contact_ratio and pair_ratio too, so that the stiffness "// &
                       "switches; not if left out")
   end subroutine add_tooth_keys

   !> Put what the data of teeth become in their place; `schema` is that of the scene.
   subroutine expand_teeth(said, schema, error)
      type(entries_t), intent(inout) :: said
      type(group_spec_t), intent(in) :: schema(:)
      type(error_t), allocatable, intent(out) :: error

      type(group_spec_t), allocatable :: spec(:)
      type(entries_t) :: found, rest
      type(input_t) :: input
      type(string_t), allocatable :: options(:)
      real(wp), allocatable :: shift(:)
      integer, allocatable :: teeth(:)
      character(:), allocatable :: mesh
      real(wp) :: base, helix, mean, normal, ratio, width
      integer :: g, gone, i, k, n
      logical :: in_turn

      g = group_at(schema, "gear_mesh")
      if (g == 0) return
      allocate (options(0))
      gone = merge(of_all_scenes, size(tooth_data), group_at(schema, "shaft") > 0)
      spec = schema(g:g)
      spec(1)%keys%required = .false.
      call check_input(input, said, spec, error, lenient=.true.)
      do i = 1, input%count("gear_mesh")
         if (allocated(error)) return
         n = findloc([(input%given("gear_mesh", i, trim(tooth_data(k))), k=1, of_all_scenes)], .true., 1)
         if (n == 0 .or. .not. input%given("gear_mesh", i, "teeth")) cycle
         call input%get("gear_mesh", i, "teeth", teeth)
         call input%get("gear_mesh", i, "width", width)
         normal = 20.0_wp
         helix = 0.0_wp
         in_turn = .false.
         call input%get("gear_mesh", i, "pressure_angle", normal)
         call input%get("gear_mesh", i, "pairs", in_turn)
         call input%get("gear_mesh", i, "helix_angle", helix)
         call input%get("gear_mesh", i, "profile_shift", shift)
         if (size(shift) == 0) shift = [0.0_wp, 0.0_wp]
         k = pinion(teeth, shift)
         ratio = contact_ratio_of(teeth, shift, normal, helix)
         if (.not. input%given("gear_mesh", i, "width") .or. input%given("gear_mesh", i, "stiffness")) then
            call input%complain(error, "gear_mesh", i, trim(tooth_data(n)), "given with width, instead of stiffness")
         else if (input%choice("gear_mesh", i, "kind") == "internal") then
            call input%complain(error, "gear_mesh", i, "width", "left out with kind = 'internal'")
         end if
         if (allocated(error)) return
         if (abs(normal - 20.0_wp) > 5.0_wp .or. helix > 45.0_wp) then
            call input%complain(error, "gear_mesh", i, "width", "pressure angles from 15 to 25 and helix angles up to 45 degrees")
         else if (shift(k) < shift(3 - k) .or. abs(sum(shift) - 0.75_wp) > 1.25_wp) then
       call input%complain(error, "gear_mesh", i, "profile_shift", "that of the gear with fewer teeth not below the other, and "// &
                                "a sum from -0.5 to 2.0, where ISO 6336-1 knows the stiffness")
         else if (.not. ratio >= 1.0_wp) then
            call input%complain(error, "gear_mesh", i, "teeth", "teeth of which the next come into mesh before those go")
         end if
         if (allocated(error)) return
         mean = single_stiffness(teeth, shift, normal, helix)*(0.75_wp*ratio + 0.25_wp)*merge(0.9_wp, 1.0_wp, ratio < 1.2_wp)
         ! Beside shafts the deformation is that along the normal of the flanks, less by the cosine of the helix at the base.
         base = sin(helix*pi/180)*cos(normal*pi/180)
         if (gone == of_all_scenes) mean = mean/(1 - base**2)
         mesh = indexed("gear_mesh", i)//"%"
         call append_text(options, mesh//"stiffness="//to_text(mean*width))
         if (.not. in_turn) cycle
         n = floor(ratio)
         call append_text(options, mesh//"contact_ratio="//to_text(ratio))
         call append_text(options, mesh//"pair_ratio="//to_text((3*n + 4.0_wp)/(3*n + 1)))
      end do
      if (allocated(error) .or. size(options) == 0) return
      ! A text has a group at least.
      call read_entries(found, "&gear_mesh /", said%file, options, error)
      call pick(said, [(said%list(i)%path%group /= "gear_mesh" .or. all(said%list(i)%path%key /= tooth_data(:gone)), &
                        i=1, size(said%list))], rest)
      said%list = [rest%list, found%list(2:)]
   end subroutine expand_teeth

   !> Data of teeth that a sweep would vary have become numbers before.
   subroutine refuse_gone(input, i, error)
      type(input_t), intent(in) :: input
      integer, intent(in) :: i
      type(error_t), allocatable, intent(inout) :: error

      integer :: k

      do k = 1, of_all_scenes
         if (.not. input%given("gear_mesh", i, trim(tooth_data(k)))) cycle
         call input%complain(error, "gear_mesh", i, trim(tooth_data(k)), "no data of teeth, which become the stiffness as the "// &
                             "input is read: that varies")
         return
      end do
   end subroutine refuse_gone

   !> The transverse contact ratio of two external gears; angles in deg. NaN where no angle is that of their mesh.
   pure function contact_ratio_of(teeth, shift, normal, helix) result(ratio)
      integer, intent(in) :: teeth(2)
      real(wp), intent(in) :: shift(2), normal, helix
      real(wp) :: ratio

      real(wp) :: alpha, base(2), involute, tip(2), working
      integer :: round

      alpha = atan(tan(normal*pi/180)/cos(helix*pi/180))
      involute = tan(alpha) - alpha + 2*sum(shift)*tan(normal*pi/180)/sum(teeth)
      ratio = 0.0_wp
      if (.not. involute > 0.0_wp) return
      ! Newton's method comes down from above to the zero of a convex function.
      working = min((3*involute)**(1.0_wp/3.0_wp), 1.5_wp)
      do round = 1, 60
         working = working - (tan(working) - working - involute)/tan(working)**2
      end do
      base = teeth*cos(alpha)/2
      tip = teeth/2.0_wp + (1 + shift)*cos(helix*pi/180)
      ratio = (sum(sqrt(tip**2 - base**2)) - sum(base)*tan(working))/(pi*cos(alpha))
   end function contact_ratio_of

   !> The gear with fewer teeth, of equal ones that with the larger shift, which is far below 10.
   pure integer function pinion(teeth, shift)
      integer, intent(in) :: teeth(2)
      real(wp), intent(in) :: shift(2)

      pinion = minloc(teeth - shift/10, 1)
   end function pinion

   !> c' of two external gears of steel, N/m for each m of width, in the transverse plane; angles in deg.
   pure function single_stiffness(teeth, shift, normal, helix) result(stiffness)
      integer, intent(in) :: teeth(2)
      real(wp), intent(in) :: shift(2), normal, helix
      real(wp) :: stiffness

      real(wp), parameter :: c(9) = [0.04723_wp, 0.15551_wp, 0.25791_wp, -0.00635_wp, -0.11654_wp, -0.00193_wp, -0.24188_wp, &
                                     0.00529_wp, 0.00182_wp]
      real(wp) :: x1, x2, z1, z2
      integer :: k

      k = pinion(teeth, shift)
      z1 = teeth(k)/cos(helix*pi/180)**3
      z2 = teeth(3 - k)/cos(helix*pi/180)**3
      x1 = shift(k)
      x2 = shift(3 - k)
      stiffness = 1.0e9_wp*0.8_wp*0.975_wp*(1 - 0.02_wp*(20 - normal))*cos(helix*pi/180) &
                  /dot_product(c, [1.0_wp, 1/z1, 1/z2, x1, x1/z1, x2, x2/z2, x1**2, x2**2])
   end function single_stiffness

end module razy_scenes_teeth
